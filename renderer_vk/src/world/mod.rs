//! The relit world on the GPU, with visible surfaces, fog, light and decals for the scene.

mod grid;
mod load;
mod marks;
mod patch_lod;
mod tangents;
mod tokens;
mod visible;

use glam::Vec3;
use q3bsp::{LightGridLayout, Plane, SurfaceKind};
use relight::RelitWorld;
use relight::materials::by_hand::MaterialsByHand;
use shaders::types::{self, Vertex};
use support::Aabb;
use support::slice::{part, span};

use crate::assets::Assets;
use crate::gpu::{self, Buffer, BufferUsage, Device};
use crate::settings::{MapLightChoice, Settings};

pub use grid::GridLight;
pub use load::{LightmapSink, Occluding, WorldOptions};
pub use marks::{Marked, Marker};
pub use patch_lod::PatchLod;
pub use tokens::EntityTokens;
pub(crate) use visible::outside;
pub use visible::{Tree, VisibleQuery, VisibleSet};

/// Reason why a map could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// The map is absent, unreadable or damaged.
    #[error(transparent)]
    Map(#[from] relight::LoadError),
    /// The device is out of memory or lost.
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
}

/// A drawable surface of the map; its index is that of the map's surface.
#[derive(Clone, Debug)]
pub struct WorldSurface {
    /// First index in the static index buffer; indices count from the start of the static vertex buffer. Triangles
    /// are clockwise seen from the front.
    pub first_index: u32,
    /// Number of indices; 0 for surfaces that are not drawn (flares, `nodraw` curves).
    pub index_count: u32,
    /// First vertex.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Index of the material, before remapping.
    pub material: u32,
    /// Fog volume plus one; 0: no fog.
    pub fog: u32,
    /// Bindless texture index of the lightmap page, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// Bounds in the model's space.
    pub bounds: Aabb,
    /// Plane of a planar surface; its normal points to the front.
    pub plane: Option<Plane>,
    /// Every triangle lies in `plane` and faces along its normal. Map compilers also write bent "planar" surfaces, and
    /// surfaces whose stored normal is not their triangles'; back-face culling cannot treat those as one plane.
    pub flat: bool,
    /// Type in the map.
    pub kind: SurfaceKind,
    /// Brush model of the surface; 0 is the world.
    pub model: u32,
    /// The material deforms the vertices: the surface is drawn as a dynamic mesh and is not in the static acceleration
    /// structure.
    pub deformed: bool,
    /// Its material is a sky.
    pub sky: bool,
    /// Index lists of a curve for greater distances.
    pub lod: Option<PatchLod>,
    /// Replacement in the classic look, if the normals affect the picture and the engine's differ from the surface's.
    pub classic: Option<ClassicCopy>,
}

/// A copy of a planar surface that has the single normal that the map stores, as in the engine: compilers store no
/// normal for merged faces, so that reflections and highlights on these ignore the face's direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClassicCopy {
    /// First vertex; the number of vertices is the surface's.
    pub first_vertex: u32,
    /// First index; the number of indices is the surface's.
    pub first_index: u32,
}

/// A brush model: surfaces and bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrushModel {
    /// First surface.
    pub first_surface: u32,
    /// Number of surfaces.
    pub num_surfaces: u32,
    /// Bounds in its own space.
    pub bounds: Aabb,
}

/// The world without its GPU buffers.
pub struct WorldData {
    /// The relit map.
    pub relit: RelitWorld,
    /// Vertices in the GPU's buffer: those of the relit map, then the copies for the classic look.
    pub vertices: Vec<Vertex>,
    /// Indices in the GPU's buffer: those of the relit map, then the coarser levels of curves, then the copies for the
    /// classic look.
    pub indices: Vec<u32>,
    /// The map's surfaces.
    pub surfaces: Vec<WorldSurface>,
    /// Brush models; 0 is the world.
    pub models: Vec<BrushModel>,
    /// Fog volumes; a surface's `fog` is an index into this plus one.
    pub fogs: Vec<types::Fog>,
    /// For each fog volume the material of its brush.
    pub fog_materials: Vec<u32>,
    /// Layout of the light grid.
    pub grid: Option<LightGridLayout>,
    /// Points of the light grid, overbright shift applied.
    pub grid_points: Vec<q3bsp::GridPoint>,
    /// The validated tree.
    pub tree: Tree,
    /// Unit vector towards the engine's sun.
    pub sun_direction: Vec3,
    /// World surfaces (model 0) whose material deforms them.
    pub deformed_surfaces: Vec<u32>,
    /// Surfaces that are portals or mirrors.
    pub portal_surfaces: Vec<u32>,
}

impl WorldData {
    /// Whether a surface is drawn as a dynamic mesh.
    pub fn is_deformed(&self, surface: u32) -> bool {
        self.surfaces
            .get(surface as usize)
            .is_some_and(|s| s.deformed)
    }

    /// Number of the first fog volume that a ball overlaps, plus one; 0 for none.
    pub fn fog_of_sphere(&self, centre: Vec3, radius: f32) -> u32 {
        let overlaps = |fog: &types::Fog| {
            (centre - radius).cmplt(fog.maxs).all() && (centre + radius).cmpgt(fog.mins).all()
        };
        self.first_fog(overlaps)
    }

    /// Number of the first fog volume that a box overlaps, plus one; 0 for none.
    pub fn fog_of_box(&self, bounds: &Aabb) -> u32 {
        let overlaps = |fog: &types::Fog| {
            bounds.maxs.cmpge(fog.mins).all() && bounds.mins.cmple(fog.maxs).all()
        };
        self.first_fog(overlaps)
    }

    fn first_fog(&self, overlaps: impl Fn(&types::Fog) -> bool) -> u32 {
        (1u32..)
            .zip(&self.fogs)
            .find(|(_, fog)| overlaps(fog))
            .map_or(0, |(number, _)| number)
    }

    /// The triangles of a static index range, as vertex positions in model space.
    pub fn triangles(&self, first: u32, count: u32) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let position = |i: u32| {
            self.vertices
                .get(i as usize)
                .map_or(Vec3::ZERO, |v| v.position)
        };
        part(&self.indices, span(first, count))
            .as_chunks::<3>()
            .0
            .iter()
            .map(move |t| t.map(position))
    }

    /// The vertices of a surface's copy for the classic look, if it has one.
    pub fn classic_vertices(&self, surface: &WorldSurface) -> Option<&[Vertex]> {
        let first = surface.classic?.first_vertex as usize;
        self.vertices
            .get(first..first + surface.vertex_count as usize)
    }

    /// The vertices of a surface.
    pub fn surface_vertices(&self, surface: &WorldSurface) -> &[Vertex] {
        part(
            &self.vertices,
            span(surface.first_vertex, surface.vertex_count),
        )
    }
}

/// The world with its GPU buffers.
pub struct World {
    /// Everything that the CPU needs.
    pub data: WorldData,
    /// `types::Vertex`, all surfaces.
    pub vertex_buffer: Buffer,
    /// `u32`, all surfaces.
    pub index_buffer: Buffer,
    /// `types::Fog`; a surface's `fog` less one is the index.
    pub fog_buffer: Buffer,
    /// `types::MappedVertex`, parallel to the vertices; `None` until something needs it.
    mapped: Option<Buffer>,
    /// Light of the map for the traced look; `None` before the first traced view.
    lit: Option<Lit>,
    /// The current light before files changed it; `None` before the first traced view.
    before: Option<Before>,
}

/// Stages of a map's light before hand-written files are applied.
struct Before {
    /// No file is applied.
    files: relight::world::Lighting,
    /// Files of materials are applied, and no file of lights.
    lights: relight::world::Lighting,
}

/// The current light of a map, and the alternative one.
struct Lit {
    choice: MapLightChoice,
    other: relight::world::Lighting,
    /// `World::before` of the alternative light.
    other_before: Option<Before>,
    /// The alternative light is computed; otherwise it is the map's initial light.
    found: bool,
}

/// Whether light lists are reduced by visibility rays.
#[derive(Clone, Copy)]
enum Sweep<'a> {
    /// They are, unless the cache has the result.
    Cached(Option<&'a relight::CalibrationCache>),
    /// They stay as they are.
    None,
}

/// Time and result of a change of a map's lights.
#[derive(Clone, Debug, Default)]
pub struct LightsChanged {
    /// Materials of the change that the map does not have.
    pub unknown: Vec<String>,
    /// Duration, seconds.
    pub seconds: f64,
}

impl std::ops::Deref for World {
    type Target = WorldData;

    fn deref(&self) -> &WorldData {
        &self.data
    }
}

impl World {
    /// Loads a map (game path `maps/....bsp`) and its materials. Registers brush models as `*0`, `*1`, ...
    ///
    /// # Errors
    /// [`WorldError`] when the map is absent or damaged, or the device fails. Missing materials are warnings.
    pub fn load(
        device: &Device,
        assets: &mut Assets,
        name: &str,
        settings: &Settings,
    ) -> Result<Self, WorldError> {
        let files = std::sync::Arc::clone(assets.textures.files());
        let options = WorldOptions::new(settings);
        let relit = RelitWorld::load(&*files, &assets.scripts, name, options.relight())?;
        for warning in relit.map_warnings() {
            log::warn!("{warning}");
        }
        if !relit.bsp.light_grid.is_empty() && relit.bsp.light_grid().is_none() {
            log::warn!(
                "{name}: lump lightgrid: its {} points are not those of the map's bounds; models are lit evenly",
                relit.bsp.light_grid.len()
            );
        }
        let mut failure = None;
        let data = WorldData::new(
            relit,
            &mut assets.materials,
            &mut assets.textures,
            &options,
            &mut failure,
        );
        if let Some(problem) = failure {
            return Err(problem.into());
        }
        let bounds: Vec<_> = data
            .models
            .iter()
            .map(|m| (m.bounds.mins, m.bounds.maxs))
            .collect();
        assets.models.register_inline(&bounds);
        let mut world = Self {
            vertex_buffer: Buffer::with_data(
                device,
                "world vertices",
                BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT,
                &data.vertices,
            )?,
            index_buffer: Buffer::with_data(
                device,
                "world indices",
                BufferUsage::INDEX | BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT,
                &data.indices,
            )?,
            fog_buffer: Buffer::with_data(device, "fogs", BufferUsage::STORAGE, &data.fogs)?,
            data,
            mapped: None,
            lit: None,
            before: None,
        };
        if settings.shows_surface_mapping() {
            world.read_materials(assets);
            if assets.materials.has_gloss(false) {
                world.need_mapped_vertices(device)?;
            }
        }
        Ok(world)
    }

    /// Address of the tangents and light directions of the vertices; 0 before
    /// [`need_mapped_vertices`](Self::need_mapped_vertices).
    pub fn mapped_address(&self) -> u64 {
        self.mapped.as_ref().map_or(0, Buffer::address)
    }

    /// Computes tangents and light directions of the vertices, unless they exist.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn need_mapped_vertices(&mut self, device: &Device) -> Result<(), gpu::Error> {
        if self.mapped.is_none() {
            let begin = std::time::Instant::now();
            let mapped = self.data.mapped_vertices();
            let buffer = Buffer::with_data(
                device,
                "tangents of the world",
                BufferUsage::STORAGE,
                &mapped,
            )?;
            self.mapped = Some(buffer);
            let seconds = begin.elapsed().as_secs_f32();
            log::debug!("{}: tangents took {seconds:.2} s", self.data.relit.name);
        }
        Ok(())
    }

    /// Reads files of materials for the classic look, which shows their normal maps and highlights by the settings. The
    /// traced look reads them with its lights.
    fn read_materials(&mut self, assets: &mut Assets) {
        let files = std::sync::Arc::clone(assets.textures.files());
        let (by_hand, faults) = MaterialsByHand::load(&*files, &self.data.relit.name);
        let of_images = (assets.materials).set_by_hand(by_hand, &mut assets.textures);
        for warning in faults.iter().chain(&of_images) {
            log::warn!("{}: {warning}", self.data.relit.name);
        }
    }

    /// Selects the light of the map for the traced look: `false` if it is already selected. Call before light lists are
    /// copied to the GPU. Each light is computed once, which takes a few seconds unless `cache` has it.
    pub fn light_by(
        &mut self,
        choice: MapLightChoice,
        assets: &mut Assets,
        cache: Option<&relight::CalibrationCache>,
    ) -> bool {
        if self.lit.as_ref().is_some_and(|lit| lit.choice == choice) {
            return false;
        }
        let other = self.data.relit.lighting();
        let other_before = self.before.take();
        let found = match self.lit.take() {
            None => {
                self.find_light(choice, assets, cache);
                false
            }
            Some(lit) => {
                self.data.relit.set_lighting(lit.other);
                if lit.found {
                    self.before = lit.other_before;
                    self.mark_emitters(assets);
                } else {
                    self.find_light(choice, assets, cache);
                }
                true
            }
        };
        self.lit = Some(Lit {
            choice,
            other,
            other_before,
            found,
        });
        true
    }

    /// Calibrates the initial lights if the settings request it, and sweeps their lists.
    fn find_light(
        &mut self,
        choice: MapLightChoice,
        assets: &mut Assets,
        cache: Option<&relight::CalibrationCache>,
    ) {
        let files = std::sync::Arc::clone(assets.textures.files());
        let relit = &mut self.data.relit;
        let warned = relit.warnings.len();
        if choice == MapLightChoice::Calibrated {
            relit.measure_materials(&*files);
            let options = relight::CalibrationOptions {
                cache: cache.cloned(),
                ..relight::CalibrationOptions::default()
            };
            // One line per quarter: a map may take minutes on a slow machine.
            let (name, mut reported) = (relit.name.clone(), 0);
            let begin = std::time::Instant::now();
            let report = relight::calibrate_with(relit, &options, &mut |done| {
                let quarter = (done * 4.0) as u32;
                if quarter > reported && quarter < 4 {
                    reported = quarter;
                    let left = begin.elapsed().as_secs_f32() * (1.0 - done) / done;
                    log::info!(
                        "{name}: finding its lights, only this first time: {} % done, about {left:.0} s left",
                        quarter * 25
                    );
                }
            });
            if !report.cached {
                log::info!("{}: lights found in {:.1} s", relit.name, report.seconds);
            }
        }
        for warning in relit.warnings.iter().skip(warned) {
            log::warn!("{}: {warning}", relit.name);
        }
        self.read_by_hand(assets, Sweep::Cached(cache));
    }

    /// Applies the files by hand to the map's own lights and materials, sweeps the light lists and marks emitters.
    fn read_by_hand(&mut self, assets: &mut Assets, sweep: Sweep<'_>) {
        let files = std::sync::Arc::clone(assets.textures.files());
        let relit = &mut self.data.relit;
        let warned = relit.warnings.len();
        let before_files = relit.lighting();
        relit.emit_by_hand(&*files);
        let by_hand = relit.by_hand.clone();
        self.before = Some(Before {
            files: before_files,
            lights: relit.lighting(),
        });
        if relit.light_by_hand(&*files) {
            log::info!("{}: lights as in {}", relit.name, relit.lights_file());
        }
        let swept = match sweep {
            Sweep::None => None,
            Sweep::Cached(cache) => Some(relight::light::sweep(relit, cache)),
        };
        let names = assets.materials.iter().map(|m| m.name.as_str());
        let own = relit.materials.iter().map(|m| m.name.as_str());
        let unmatched = by_hand.unmatched(&relit.name, &own.chain(names).collect::<Vec<_>>());
        relit.warnings.extend(unmatched);
        let faults = (assets.materials).set_by_hand(by_hand, &mut assets.textures);
        relit.warnings.extend(faults);
        for warning in relit.warnings.iter().skip(warned) {
            log::warn!("{}: {warning}", relit.name);
        }
        if let Some(swept) = swept {
            log::debug!(
                "{}: visibility sweep of light lists {} {:.2} s, {} of {} entries left",
                relit.name,
                if swept.cached {
                    "read from the cache in"
                } else {
                    "took"
                },
                swept.seconds,
                swept.entries[1],
                swept.entries[0]
            );
        }
        self.mark_emitters(assets);
    }

    /// Reads the files of lights and materials beside the map again. False if nothing has read them: that of lights is read
    /// by the first traced view.
    pub(crate) fn read_by_hand_again(&mut self, assets: &mut Assets) -> bool {
        let Some(before) = self.before.take() else {
            // the classic look has read those of materials if it shows their maps
            let has_read = assets.materials.has_files();
            if has_read {
                self.read_materials(assets);
            }
            return has_read;
        };
        self.data.relit.set_lighting(before.files);
        self.read_by_hand(assets, Sweep::Cached(None));
        true
    }

    /// The lights before hand-written ones changed them; `None` before the first traced view.
    pub fn lights_before_hand(&mut self) -> Option<relight::light::ChangeableLights> {
        let now = self.data.relit.lighting();
        self.data
            .relit
            .set_lighting(self.before.as_ref()?.lights.clone());
        let lights = relight::light::ChangeableLights::of(&self.data.relit);
        self.data.relit.set_lighting(now);
        Some(lights)
    }

    /// Replaces the changes of hand-written lights by others, and sweeps the light lists. No effect before the first
    /// traced view.
    pub(crate) fn light_by_hand(
        &mut self,
        by_hand: &relight::light::LightsByHand,
        assets: &mut Assets,
    ) -> LightsChanged {
        let begin = std::time::Instant::now();
        let Some(before) = &self.before else {
            return LightsChanged::default();
        };
        let relit = &mut self.data.relit;
        relit.set_lighting(before.lights.clone());
        let unknown = by_hand.apply(relit);
        relight::light::sweep(relit, None);
        self.mark_emitters(assets);
        LightsChanged {
            unknown,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }

    /// Replaces lights of the map's entities by those of others, below those by hand, which are read again. The light
    /// lists are not swept, because that takes up to seconds: they have all lights that could arrive. False if that needs
    /// the map to be loaded again.
    pub(crate) fn light_by_entities(
        &mut self,
        entities: &[q3bsp::Entity],
        assets: &mut Assets,
    ) -> bool {
        let relit = &mut self.data.relit;
        let Some(before) = &self.before else {
            return relit.replace_light_entities(entities);
        };
        let now = relit.lighting();
        relit.set_lighting(before.files.clone());
        if !relit.replace_light_entities(entities) {
            relit.set_lighting(now);
            return false;
        }
        self.read_by_hand(assets, Sweep::None);
        true
    }

    /// Marks the materials that are in the light lists.
    fn mark_emitters(&self, assets: &mut Assets) {
        assets.materials.forget_emitters();
        for (surface, stored) in self.data.surfaces.iter().zip(&self.data.relit.surfaces) {
            load::mark_emitter(
                &self.data.relit,
                stored,
                surface.material,
                &mut assets.materials,
            );
        }
    }
}

#[cfg(test)]
mod tests;
