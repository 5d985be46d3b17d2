//! All materials of a registration: looked up by name as in the engine, compiled to the arrays that shaders read.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use glam::Vec3;
use relight::materials::by_hand::MaterialsByHand;
use shaders::types;
use shaderscript::{ImplicitKind, RgbGen, Shader, StageImage, strip_extension};
use support::slice::{part, span};

mod changes;
mod listing;

use super::bind::{internal_shader, passes, sky_faces};
use super::compile::{FOG_IMAGE, StageArrays, VideoClients, sampler};
use super::dielectric;
use super::finish::OfScript;
use super::flags;
use super::light_stage;
use super::lit_texture;
use super::material::{LightmapClass, Material, SkyBox, VideoStage};
use super::material_buffers::Uploaded;
use super::prepare::grey;
use super::source::{ImageFlags, ImageSource};
use crate::settings::Settings;

/// Distance at which a portal without `alphaGen portal` is opaque, units: the engine's default.
pub const DEFAULT_PORTAL_RANGE: f32 = 256.0;

/// Settings that apply to materials when they are loaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialSettings {
    /// Stages marked `detail` are drawn.
    pub detail_textures: bool,
    /// One stage with vertex light instead of lightmaps.
    pub vertex_light: bool,
    /// Overrides `vertex_light`: stages are unchanged, because a menu covers the game.
    pub menu: bool,
    /// The log lists the scripts in use.
    pub print: bool,
    /// 0..1: desaturation of the colours in scripts.
    pub greyscale: f32,
}

impl MaterialSettings {
    /// The part of the renderer's settings that materials depend on.
    pub fn new(settings: &Settings) -> Self {
        Self {
            detail_textures: settings.detail_textures,
            vertex_light: settings.vertex_light,
            menu: settings.ui_fullscreen,
            print: settings.print_shaders,
            greyscale: settings.greyscale,
        }
    }
}

/// Stages of a material that have been appended to the arrays.
#[derive(Default)]
struct PushedStages {
    /// Number of stages, from the first.
    count: usize,
    /// The video stages among them.
    videos: Vec<VideoStage>,
    /// Name of the missing image of the next stage.
    missing: Option<String>,
}

/// Materials by index; 0 is the default material.
pub struct Materials {
    pub(super) list: Vec<Material>,
    by_key: HashMap<(String, LightmapClass), u32>,
    pub(super) arrays: StageArrays,
    /// Radiance of each material as a light; only the traced look uses it.
    pub(super) light_radiance: Vec<Vec3>,
    /// Indices in drawing order.
    sorted: Vec<u32>,
    /// Position of each material in `sorted`.
    ranks: Vec<u32>,
    videos: VideoClients,
    pub(super) scripts: Arc<relight::Materials>,
    /// Files of materials; `None` until the first traced view, without which nobody needs what they state.
    pub(super) by_hand: Option<MaterialsByHand>,
    settings: MaterialSettings,
    internal: Internal,
    cloud_height: f32,
    last_sun: Option<Vec3>,
    pub(super) uploaded: Option<Uploaded>,
    pub(super) dirty: bool,
    generation: u64,
    /// Lightmap pages of each material's surfaces.
    pages: BTreeSet<(u32, i32)>,
}

/// Materials of the renderer's own geometry.
#[derive(Clone, Copy, Debug, Default)]
pub struct Internal {
    /// Red, additive: beams.
    pub beam: u32,
    /// Vertex colour: the axes that replace a missing model.
    pub axes: u32,
    /// The white image with vertex colour, for the 2D overlay.
    pub white: u32,
    /// The game's material for planar shadows (`cg_shadows 3`), if it has one.
    pub shadow: Option<u32>,
    /// Bindless texture of the fog image.
    pub fog_image: u32,
    /// The game's material for the sun's disc (`r_drawSun`), if it has one.
    pub sun: Option<u32>,
    /// The game's material for flares, if it has one.
    pub flare: Option<u32>,
}

/// Name of the script for planar shadows, as in the engine.
const SHADOW_MATERIAL: &str = "projectionShadow";
/// Name of the script for the sun.
const SUN_MATERIAL: &str = "sun";
/// Name of the script for all flares, as in the engine, whatever material the flare surfaces have.
const FLARE_MATERIAL: &str = "flareShader";

impl Materials {
    /// The default material and the renderer's own materials. `scripts`: those of the game.
    pub fn new(
        scripts: Arc<relight::Materials>,
        settings: MaterialSettings,
        source: &mut dyn ImageSource,
    ) -> Self {
        let mut materials = Self {
            list: Vec::new(),
            by_key: HashMap::new(),
            arrays: StageArrays::default(),
            light_radiance: Vec::new(),
            sorted: Vec::new(),
            ranks: Vec::new(),
            videos: VideoClients::default(),
            scripts,
            by_hand: None,
            settings,
            internal: Internal::default(),
            cloud_height: 512.0,
            last_sun: None,
            uploaded: None,
            dirty: true,
            generation: 0,
            pages: BTreeSet::new(),
        };
        let mut default = internal_shader("*default", |stage| {
            stage.image = StageImage::Map("*default".into());
            stage.rgb_gen = RgbGen::Identity;
        });
        default.cull = shaderscript::Cull::Front;
        materials.add(
            "*default",
            default,
            LightmapClass::None,
            false,
            None,
            source,
        );
        let mut beam = internal_shader("*beam", |stage| {
            stage.rgb_gen = RgbGen::Const(Vec3::X);
            stage.blend = Some((
                shaderscript::BlendFactor::One,
                shaderscript::BlendFactor::One,
            ));
            stage.depth_write = false;
        });
        // the engine keeps the culling state of the previously drawn surface, which mostly is one-sided
        beam.cull = shaderscript::Cull::Front;
        materials.internal.beam =
            materials.add("*beam", beam, LightmapClass::None, false, None, source);
        let axes = internal_shader("*axes", |stage| {
            stage.rgb_gen = RgbGen::ExactVertex;
        });
        materials.internal.axes =
            materials.add("*axes", axes, LightmapClass::None, false, None, source);
        let fog = source.image(FOG_IMAGE, ImageFlags::NO_MIP);
        materials.internal.fog_image = fog.map_or_else(|| source.white(), |(texture, _)| texture);
        let mut white = Shader::implicit("*white", ImplicitKind::TwoD);
        for stage in &mut white.stages {
            stage.image = StageImage::White;
        }
        materials.internal.white =
            materials.add("*white", white, LightmapClass::TwoD, false, None, source);
        let mut scripted = |name| {
            materials.scripts.library().find(name)?;
            Some(materials.find(source, name, LightmapClass::None, true))
        };
        // in the engine's order of creation
        let shadow = scripted(SHADOW_MATERIAL);
        let flare = scripted(FLARE_MATERIAL);
        let sun = scripted(SUN_MATERIAL);
        materials.internal.shadow = shadow;
        materials.internal.flare = flare;
        materials.internal.sun = sun;
        materials
    }

    /// The index of the material with a name and a class, compiled at its first use.
    ///
    /// Identity as in the engine: the name without extension, compared without case, and the class; a name without a
    /// usable definition is one material for all classes. `mip` applies only to names without a script.
    pub fn find(
        &mut self,
        source: &mut dyn ImageSource,
        name: &str,
        class: LightmapClass,
        mip: bool,
    ) -> u32 {
        if name.is_empty() {
            return 0;
        }
        let class = if self.settings.vertex_light && class == LightmapClass::Page {
            LightmapClass::Vertex
        } else {
            class
        };
        let stripped = strip_extension(name).to_ascii_lowercase();
        if let Some(found) = self.known(&stripped, class) {
            return found;
        }
        let key = (stripped, class);
        let index = if let Some(shader) = self.scripts.library().find(name).cloned() {
            if self.settings.print {
                log::info!("*SHADER* {name}");
            }
            self.tell_warnings(&shader);
            self.add(strip_extension(name), shader, class, true, None, source)
        } else {
            let kind = match class {
                LightmapClass::Page => ImplicitKind::Lightmapped,
                LightmapClass::None => ImplicitKind::EntityLit,
                LightmapClass::White => ImplicitKind::White,
                LightmapClass::Vertex => ImplicitKind::Vertex,
                LightmapClass::TwoD => ImplicitKind::TwoD,
            };
            let (shader, flags) = if mip {
                (Shader::implicit(name, kind), ImageFlags::WORLD)
            } else {
                (Shader::implicit_no_mip(name, kind), ImageFlags::NO_MIP)
            };
            self.add(
                strip_extension(name),
                shader,
                class,
                false,
                Some(flags),
                source,
            )
        };
        self.by_key.insert(key, index);
        index
    }

    /// Logs the engine's warnings about a script when its first material is made.
    fn tell_warnings(&self, shader: &Shader) {
        let class = |class| (shader.name.to_ascii_lowercase(), class);
        let has = |c: &LightmapClass| self.by_key.contains_key(&class(*c));
        if LightmapClass::ALL.iter().any(has) {
            return;
        }
        for warning in self.scripts.library().warnings_of(shader) {
            log::warn!("{warning}");
        }
    }

    fn known(&self, stripped: &str, class: LightmapClass) -> Option<u32> {
        let find = |class| self.by_key.get(&(stripped.to_owned(), class)).copied();
        find(class).or_else(|| {
            LightmapClass::ALL
                .into_iter()
                .filter_map(find)
                .find(|&index| self.get(index).defaulted)
        })
    }

    /// [`find`](Self::find), with the default material instead of an unusable one, as world and model surfaces use it.
    pub fn find_or_default(
        &mut self,
        source: &mut dyn ImageSource,
        name: &str,
        class: LightmapClass,
    ) -> u32 {
        let index = self.find(source, name, class, true);
        if self.get(index).defaulted { 0 } else { index }
    }

    /// Reports a missing image. `place`: of the script that names it; menus and mods often request absent images, so that
    /// only scripts cause a warning.
    fn tell_missing(&self, name: &str, place: Option<&String>, image: &str) {
        match place {
            Some(place) => {
                let fault = format!("{place}: image {image} is missing");
                self.scripts.tell_fault(name, &fault);
            }
            None => log::debug!("{name}: no script and no image of that name"),
        }
    }

    /// Binds a definition to its images and appends it.
    fn add(
        &mut self,
        name: &str,
        mut shader: Shader,
        class: LightmapClass,
        explicit: bool,
        implicit: Option<ImageFlags>,
        source: &mut dyn ImageSource,
    ) -> u32 {
        let mut defaulted = shader.rejected.is_some();
        let place = format!("{}:{}", shader.location.file, shader.location.line);
        if let Some(reason) = &shader.rejected {
            self.scripts.tell_fault(name, &format!("{place}: {reason}"));
        }
        // the engine loads the images of all stages before it drops any stage
        let written = shader.stages.clone();
        self.apply_settings(&mut shader);
        if let Some(sun) = &shader.sun {
            self.last_sun = Some(sun.direction.normalize_or_zero());
        }
        // the sort value depends on all stages
        let sort = shader.sort_value();
        if self.settings.vertex_light && !self.settings.menu && shader.stages.len() > 1 {
            shader = shaderscript::collapse_vertex_light(&shader, class == LightmapClass::None);
        }
        let mut missing = None;
        if shader.stages.len() < written.len() {
            missing = self.missing_image(&written, source);
            if missing.is_some() {
                shader.stages.clear();
            }
        }
        let stage_first = self.arrays.stages.len();
        let pushed = self.push_stages(&shader, class, implicit, source);
        let kept = pushed.count;
        let missing = missing.or(pushed.missing);
        if let Some(image) = missing {
            self.tell_missing(name, explicit.then_some(&place), &image);
            defaulted = true;
        }
        shader.stages.truncate(kept);
        let sky = shader.sky.clone().map(|sky| {
            self.cloud_height = sky.cloud_height;
            SkyBox {
                faces: sky
                    .outer
                    .as_deref()
                    .and_then(|outer| sky_faces(outer, source)),
            }
        });
        let stage_first = u32::try_from(stage_first).unwrap_or(u32::MAX);
        let stage_count = u32::try_from(kept).unwrap_or(0);
        let order = u32::try_from(self.list.len()).unwrap_or(u32::MAX);
        self.light_radiance.push(Vec3::ZERO);
        let dielectric =
            dielectric::dielectric(&shader, class, &self.arrays, stage_first as usize, source);
        let flags = flags::material_flags(&shader, class) | dielectric::mirrors(&dielectric);
        let material = Material {
            of_script: OfScript { flags, dielectric },
            name: name.to_owned(),
            lightmap_class: class,
            explicit,
            defaulted,
            sort,
            order,
            flags,
            dielectric,
            metallic: false,
            specular: types::Specular::default(),
            cull: shader.cull,
            polygon_offset: shader.polygon_offset,
            passes: passes(&shader, stage_first),
            stage_first,
            stage_count,
            light_stage: light_stage::light_stage(&shader, sort)
                .and_then(|stage| stage_first.checked_add(u32::try_from(stage).ok()?)),
            lit_texture: lit_texture::lit_texture(&shader, class)
                .map(|lit| lit.of_gpu(stage_first)),
            sky,
            fog: shader.fog,
            surface_flags: shader.surface_flags,
            content_flags: shader.content_flags,
            portal_range: portal_range(&shader),
            remapped: None,
            time_offset: 0.0,
            videos: pushed.videos,
            shader,
        };
        self.list.push(material);
        for fault in self.finish(order as usize, source) {
            log::warn!("{fault}");
        }
        self.insert_sorted(order, sort);
        self.touch();
        order
    }

    /// Removes stages and colour according to the settings.
    fn apply_settings(&self, shader: &mut Shader) {
        if !self.settings.detail_textures {
            shader.stages.retain(|stage| !stage.detail);
        }
        for stage in &mut shader.stages {
            if let RgbGen::Const(color) = &mut stage.rgb_gen {
                *color = grey(*color, self.settings.greyscale);
            }
        }
    }

    /// Loads the images of stages; returns the name of the first missing one.
    fn missing_image(
        &mut self,
        stages: &[shaderscript::Stage],
        source: &mut dyn ImageSource,
    ) -> Option<String> {
        stages.iter().find_map(|stage| {
            self.arrays
                .need_stage(stage, &mut self.videos, source)
                .err()
        })
    }

    /// Appends the stages of a material to the arrays, up to the first with a missing image.
    fn push_stages(
        &mut self,
        shader: &Shader,
        class: LightmapClass,
        implicit: Option<ImageFlags>,
        source: &mut dyn ImageSource,
    ) -> PushedStages {
        let mut pushed = PushedStages::default();
        let mut baked = relight::materials::light::baked_light(&shader.stages).into_iter();
        for (number, stage) in shader.stages.iter().enumerate() {
            let (index, video) =
                match (self.arrays).push_stage(stage, implicit, &mut self.videos, source) {
                    Ok(appended) => appended,
                    Err(image) => {
                        pushed.missing = Some(image);
                        break;
                    }
                };
            pushed.count += 1;
            let flags = flags::stage_flags(shader, class, number, baked.next().flatten());
            if let Some(appended) = self.arrays.stages.get_mut(index as usize) {
                appended.flags |= flags;
            }
            pushed.videos.extend(video.map(|(name, client)| VideoStage {
                stage: index,
                name,
                client,
            }));
        }
        pushed
    }

    /// Inserts a material into the drawing order: by sort value, then by creation.
    fn insert_sorted(&mut self, index: u32, sort: f32) {
        let at = self
            .sorted
            .partition_point(|&other| self.get(other).sort.total_cmp(&sort).is_le());
        self.sorted.insert(at, index);
        self.ranks.resize(self.list.len(), 0);
        for (rank, &material) in (0u32..).zip(&self.sorted).skip(at) {
            if let Some(slot) = self.ranks.get_mut(material as usize) {
                *slot = rank;
            }
        }
    }

    /// A material; the default material for an invalid index.
    pub fn get(&self, index: u32) -> &Material {
        self.list.get(index as usize).unwrap_or(&self.list[0])
    }

    /// Number of materials.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Always `false`: the default material exists.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Every material in order of creation.
    pub fn iter(&self) -> impl Iterator<Item = &Material> {
        self.list.iter()
    }

    /// The material that replaces `index` (`RemapShader`).
    pub fn resolve(&self, index: u32) -> u32 {
        let index = if (index as usize) < self.list.len() {
            index
        } else {
            0
        };
        self.get(index).remapped.unwrap_or(index)
    }

    /// Position of a material in the drawing order.
    pub fn rank(&self, index: u32) -> u32 {
        self.ranks.get(index as usize).copied().unwrap_or(0)
    }

    /// Materials in drawing order.
    pub fn sorted(&self) -> &[u32] {
        &self.sorted
    }

    /// The index of a handle from the game; the default material for an invalid handle.
    pub fn of_handle(&self, handle: i32) -> u32 {
        u32::try_from(handle)
            .ok()
            .filter(|&index| (index as usize) < self.list.len())
            .unwrap_or(0)
    }

    /// Settings for materials that are loaded from now on.
    pub fn set_settings(&mut self, settings: MaterialSettings) {
        self.settings = settings;
    }

    /// The renderer's own materials.
    pub fn internal(&self) -> Internal {
        self.internal
    }

    /// Height of the cloud layer of all skies, units: that of the last parsed sky, because the engine has one dome for
    /// all.
    pub fn cloud_height(&self) -> f32 {
        self.cloud_height
    }

    /// Direction towards the sun by the last parsed material that defines a sun.
    pub fn last_sun(&self) -> Option<Vec3> {
        self.last_sun
    }

    /// Drops the sun of parsed materials, before a map is loaded.
    pub fn forget_sun(&mut self) {
        self.last_sun = None;
    }

    /// Video files in use with their client numbers.
    pub fn videos(&self) -> impl Iterator<Item = (&str, usize)> {
        self.videos.iter()
    }

    /// A material's stages on the CPU; samplers are kinds, not bindless indices.
    pub fn stages(&self, material: &Material) -> &[types::Stage] {
        let range = span(material.stage_first, material.stage_count);
        part(&self.arrays.stages, range)
    }

    /// Bindless texture of a stage with one constant image, and whether it is clamped at its edges.
    pub fn image(&self, stage: &types::Stage) -> Option<(u32, bool)> {
        let texture = self.arrays.images.get(stage.image_first as usize)?;
        let repeats = [sampler::REPEAT_MIP, sampler::REPEAT].contains(&stage.sampler_index);
        (stage.image_count == 1).then_some((*texture, !repeats))
    }

    /// The arrays, on the CPU.
    pub fn arrays(&self) -> &StageArrays {
        &self.arrays
    }

    /// Marks all arrays for upload, after a change of samplers.
    pub fn invalidate(&mut self) {
        self.touch();
    }

    pub(super) fn touch(&mut self) {
        self.dirty = true;
        self.generation += 1;
    }

    /// A number that grows whenever a material is added or changed.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Records that a surface of the map shows a material with a lightmap page. The engine counts each page as a
    /// material of its own; here one material serves all pages.
    pub fn note_lightmap_page(&mut self, material: u32, page: i32) {
        if self.get(material).lightmap_class == LightmapClass::Page {
            self.pages.insert((material, page));
        }
    }
}

/// Distance at which a portal is opaque, units.
fn portal_range(shader: &Shader) -> f32 {
    let range = |stage: &shaderscript::Stage| match stage.alpha_gen {
        shaderscript::AlphaGen::Portal { range } => Some(range),
        _ => None,
    };
    (shader.stages.iter().find_map(range)).unwrap_or(DEFAULT_PORTAL_RANGE)
}
