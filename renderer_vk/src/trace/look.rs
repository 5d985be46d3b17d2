//! Adapter of the traced look: converts the loaded map and its assets to the tracer's input.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use glam::Vec2;
use shaders::trace_types::SkyRecord;
use shaders::types::constants::{MATERIAL_CLEAR, MATERIAL_EMITTER, NO_TEXTURE};
use shaders::types::{Fog, MaterialBuffers};

#[cfg(test)]
use super::accel::AccelMemory;
use super::ahead::MapNeeds;
use super::cutout::{Coverage, coverage, mean_coverage};
use super::fog_light;
use super::geometry::StaticGeometry;
use super::input::{Kind, MaterialInfo, MaterialTable, StaticScene, StaticSurface};
use super::lights::{MapLightSource, MapLights};
use super::pass_set::PassSet;
use super::passes::counter_of;
use super::surroundings::Surroundings;
use super::tracer::Tracer;
use super::view_tracer::{TracedMap, TracedView, ViewTracer};
use relight::light::{Occlusion, Sight, TriangleLight};

use crate::assets::compile::sampler;
use crate::assets::{Assets, Materials};
use crate::gpu::{ColorMask, Device, Error, Image, Recorder};
use crate::raster::FlareTest;
use crate::scene::TracedScene;
use crate::settings::Settings;
use crate::statistics::{LightCost, MovingCost, StructureCost};
use crate::world::World;

/// Sort value of the engine's first class of blended surfaces (`SS_BLEND0`).
const SORT_BLENDED: f32 = 9.0;

impl MaterialTable for Assets {
    fn info(&self, index: u32) -> (u32, MaterialInfo) {
        let drawn = self.materials.resolve(index);
        let material = self.materials.get(drawn);
        let sky = material.sky.as_ref().map(|sky| SkyRecord {
            faces: sky.faces.unwrap_or([NO_TEXTURE; 6]),
            cloud_height: self.materials.cloud_height(),
        });
        let info = MaterialInfo {
            flags: material.flags,
            sort: match material.flags & MATERIAL_CLEAR {
                0 => material.sort,
                _ => material.sort.max(SORT_BLENDED),
            },
            order: material.order,
            sky,
        };
        (drawn, info)
    }

    fn mean_coverage(&self, material: u32) -> Option<f32> {
        mean_coverage(self, material)
    }

    fn coverage(&self, material: u32, corners: [Vec2; 3]) -> Coverage {
        coverage(self, material, corners)
    }

    fn buffers(&self) -> MaterialBuffers {
        self.materials.addresses()
    }

    fn generation(&self) -> u64 {
        self.materials.generation()
    }

    fn has_gloss(&self, frosted: bool) -> bool {
        self.materials.has_gloss(frosted)
    }

    fn has_metal(&self) -> bool {
        self.materials.has_metal()
    }

    fn has_heights(&self) -> bool {
        self.materials.has_heights()
    }

    fn sky_sampler(&self) -> u32 {
        self.samplers.index(sampler::CLAMP_MIP)
    }
}

/// A number that changes when a material is remapped, when files of materials change its `MATERIAL_*` bits, or when the
/// height of a sky's clouds changes.
pub(super) fn remapping(materials: &Materials) -> u64 {
    let mut hasher = DefaultHasher::new();
    materials.cloud_height().to_bits().hash(&mut hasher);
    for material in materials.iter() {
        if material.flags & !MATERIAL_EMITTER != material.of_script.flags {
            (material.order, material.flags & !MATERIAL_EMITTER).hash(&mut hasher);
        }
        if let Some(drawn) = material.remapped {
            (material.order, drawn).hash(&mut hasher);
        }
    }
    hasher.finish()
}

/// The map's geometry of constant shape.
pub(super) fn static_scene<'a>(world: &'a World, fogs: &'a [Fog]) -> StaticScene<'a> {
    let data = &world.data;
    let surfaces = data
        .surfaces
        .iter()
        .zip(0..)
        .filter(|(s, _)| s.index_count > 0 && !s.deformed);
    StaticScene {
        vertices: &data.vertices,
        vertex_address: world.vertex_buffer.address(),
        mapped_address: world.mapped_address(),
        indices: &data.indices,
        surfaces: surfaces
            .map(|(s, number)| StaticSurface {
                first_index: s.first_index,
                index_count: s.index_count,
                material: s.material,
                fog: s.fog,
                lightmap: s.lightmap,
                model: s.model,
                number,
                curved: s.kind == q3bsp::SurfaceKind::Patch,
            })
            .collect(),
        fogs,
    }
}

/// Acceleration structures of the map's constant geometry.
fn geometry(
    device: &Device,
    structures: (Tracer, u32),
    world: &World,
    fogs: &[Fog],
    assets: &Assets,
    sight: &Sight,
) -> Result<StaticGeometry, Error> {
    let mut geometry = StaticGeometry::new(device, structures, &static_scene(world, fogs), assets)?;
    geometry.surroundings = Surroundings::new(device, world, assets)?;
    geometry.mirrors.find_reach(device, sight)?;
    Ok(geometry)
}

/// Whether rays of bounces can hit a triangle light where it is.
fn is_hittable(world: &World, assets: &Assets, light: &TriangleLight) -> bool {
    let surface = world.data.surfaces.get(light.surface as usize);
    let Some(surface) = surface.filter(|surface| !surface.deformed) else {
        return false;
    };
    let (_, info) = assets.info(surface.material);
    let stops = matches!(
        Kind::in_light(info.flags, true),
        Some(Kind::Opaque | Kind::Tested | Kind::Sky)
    );
    light.triangle != u32::MAX && stops
}

/// Calls `with` with the lights of a map.
fn with_lights<T>(
    world: &World,
    assets: &Assets,
    with: impl FnOnce(&MapLightSource<'_>) -> Result<T, Error>,
) -> Result<T, Error> {
    let relit = &world.data.relit;
    let model_origins: Vec<_> = relit.models.iter().map(|m| m.origin).collect();
    let flickers: Vec<_> = relit.lights.iter().map(|l| relit.flicker_of(l)).collect();
    let occlusion = Occlusion::new(relit);
    let hittable: Vec<bool> = (relit.lights.iter())
        .map(|light| is_hittable(world, assets, light))
        .collect();
    let source = MapLightSource {
        hittable: &hittable,
        triangles: &relit.lights,
        points: &relit.point_lights,
        suns: &relit.suns,
        lists: &relit.light_lists,
        flickers: &flickers,
        model_origins: &model_origins,
        ambient: relit.ambient,
        light_cutoff: relit.light_cutoff,
        cutoff_of_points: relit.has_compiled_lights,
        bsp: Some(&relit.bsp),
        occlusion: Some(&occlusion),
    };
    with(&source)
}

/// A view of the loaded map, with its inputs and target.
#[derive(Clone, Copy)]
pub struct MapView<'a> {
    /// What the view shows.
    pub scene: &'a TracedScene,
    /// The loaded map.
    pub world: &'a World,
    /// Textures, materials and models.
    pub assets: &'a Assets,
    /// Settings of the frame.
    pub settings: &'a Settings,
    /// The image that the view's rectangle is in: RGBA8, usable as storage image.
    pub target: &'a Image,
    /// Flares of the view whose visibility rays test.
    pub flares: FlareTest,
    /// Colour channels of the target that are written.
    pub mask: ColorMask,
}

/// The traced look of one map.
pub struct TraceLook {
    pub(super) tracer: ViewTracer,
    /// Tracer of the right eye in stereo; each eye has its own history.
    right: Option<Box<ViewTracer>>,
    /// Slope of the eye that was drawn first, while the other eye of the frame is not drawn.
    first_eye: Option<f32>,
    passes: Arc<PassSet>,
    /// `rt_gridCells`.
    grid_cells: u32,
    geometry: StaticGeometry,
    /// The map's fog volumes, with their mean light.
    fogs: Vec<Fog>,
    lights: MapLights,
    /// Remapping of the materials at the time when `geometry` was built.
    remapping: u64,
}

impl TraceLook {
    /// Builds the map's acceleration structures and light lists. `grid_cells`: `rt_gridCells`.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn new(
        passes: &Arc<PassSet>,
        grid_cells: u32,
        world: &World,
        assets: &Assets,
    ) -> Result<Self, Error> {
        let (device, tracer) = (passes.device(), passes.tracer());
        let mut view_tracer = ViewTracer::new(passes)?;
        let exposure = world.data.relit.display_exposure();
        view_tracer.map_exposure = exposure;
        let (fogs, mut lights) = with_lights(world, assets, |source| {
            let fogs = fog_light::lit(&world.data.fogs, source);
            Ok((fogs, MapLights::new(device, source)?))
        })?;
        let structures = (tracer, grid_cells);
        let geometry = geometry(device, structures, world, &fogs, assets, &lights.sight)?;
        lights.white = exposure.scale.recip();
        lights.find_fogs(&geometry.fog_boxes);
        Ok(Self {
            tracer: view_tracer,
            right: None,
            first_eye: None,
            passes: Arc::clone(passes),
            grid_cells,
            geometry,
            fogs,
            lights,
            remapping: remapping(&assets.materials),
        })
    }

    /// Takes over the lights of a world whose lights have changed. The light of its fogs stays.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn change_lights(&mut self, world: &World, assets: &Assets) -> Result<(), Error> {
        let device = self.passes.device();
        let mut lights = with_lights(world, assets, |source| MapLights::new(device, source))?;
        lights.white = self.lights.white;
        lights.find_fogs(&self.geometry.fog_boxes);
        self.lights = lights;
        let right = self.right.as_deref_mut();
        for tracer in [&mut self.tracer].into_iter().chain(right) {
            tracer.forget_accumulated();
        }
        Ok(())
    }

    /// What decides which passes frames of the map run.
    pub fn needs(&self, world: &World, assets: &Assets) -> MapNeeds {
        MapNeeds {
            fog: !world.data.relit.bsp.fogs.is_empty(),
            mirrors: self.geometry.mirrors.count(true, None) > 0,
            bodies: !self.geometry.bodies.is_empty(),
            gloss: assets.materials.has_gloss(false),
            heights: assets.materials.has_heights(),
            frosted: assets.materials.has_gloss(true),
            metal: assets.materials.has_metal(),
        }
    }

    /// Number of frames in the mean of `rt_accumulate`.
    pub fn accumulated_frames(&self) -> u32 {
        self.tracer.accumulated_frames()
    }

    /// Lets the next `frames` frames join that mean whatever they show.
    pub fn join_frames(&mut self, frames: u32) {
        self.tracer.join_frames(frames);
        if let Some(right) = &mut self.right {
            right.join_frames(frames);
        }
    }

    /// Replaces that mean; false if there is none.
    ///
    /// # Errors
    /// A wrong number of texels, or no memory to upload them.
    pub fn replace_mean(&mut self, texels: &[[f32; 4]]) -> Result<bool, Error> {
        self.tracer.replace_mean(texels)
    }

    /// Records all passes of a view into its rectangle of the target, and tests the visibility of its flares.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record(&mut self, rec: &mut Recorder, view: MapView<'_>) -> Result<(), Error> {
        let MapView {
            scene,
            world,
            assets,
            settings,
            target,
            flares,
            mask,
        } = view;
        let remapping = remapping(&assets.materials);
        if remapping != self.remapping {
            // triangles store their materials; a game remaps when a flag or a button changes its look
            self.geometry = geometry(
                rec.device(),
                (self.tracer(), self.grid_cells),
                world,
                &self.fogs,
                assets,
                &self.lights.sight,
            )?;
            self.remapping = remapping;
        }
        let map = TracedMap {
            geometry: &self.geometry,
            lights: &self.lights,
            flares,
        };
        let slope = scene.view.stereo.slope;
        let other = if slope < 0.0 {
            Some(&self.tracer)
        } else {
            self.right.as_deref()
        };
        let is_second = self.first_eye == Some(-slope) && slope != 0.0;
        self.first_eye = (!is_second).then_some(slope);
        let shared = other
            .filter(|_| is_second)
            .and_then(|other| other.for_other_eye(scene, settings));
        let tracer = if slope < 0.0 {
            match &mut self.right {
                Some(made) => made,
                none => {
                    let mut made = ViewTracer::new(&self.passes)?;
                    made.map_exposure = self.tracer.map_exposure;
                    none.insert(Box::new(made))
                }
            }
        } else {
            if slope == 0.0 {
                self.right = None;
            }
            &mut self.tracer
        };
        tracer.other_eye = shared;
        let bit = |on: bool, bit: u32| if on { bit } else { 0 };
        tracer.channels = bit(mask.red, 1) | bit(mask.green, 2) | bit(mask.blue, 4);
        let view = TracedView {
            scene,
            map: Some(map),
            materials: assets,
            settings,
            target,
        };
        tracer.record_view(rec, view)
    }

    /// Records all passes of a view with a given `ViewTracer`, such as that of a screenshot.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub(super) fn record_by(
        &self,
        tracer: &mut ViewTracer,
        rec: &mut Recorder,
        view: &TracedScene,
        assets: &Assets,
        settings: &Settings,
        target: &Image,
    ) -> Result<(), Error> {
        let map = TracedMap {
            geometry: &self.geometry,
            lights: &self.lights,
            flares: FlareTest::default(),
        };
        let view = TracedView {
            scene: view,
            map: Some(map),
            materials: assets,
            settings,
            target,
        };
        tracer.record_view(rec, view)
    }

    /// The tracer.
    pub fn tracer(&self) -> Tracer {
        self.passes.tracer()
    }

    /// The pipelines of the passes.
    pub(super) fn passes(&self) -> &Arc<PassSet> {
        &self.passes
    }

    /// Switches ray counters, from the next view on.
    pub fn count_rays(&mut self, count: bool) {
        self.tracer.count_rays = count;
    }

    /// Rays of a pass in the newest finished frame; `None` for a pass without a counter, or while rays are not counted.
    pub fn rays(&self, pass: &str) -> Option<u64> {
        self.tracer.rays()?.get(counter_of(pass)?).copied()
    }

    /// Cost of the structures from which the map's lights are sampled.
    pub fn light_cost(&self) -> LightCost {
        self.lights.cost()
    }

    /// Cost of the structures of the map's constant geometry.
    pub fn structure_cost(&self) -> StructureCost {
        self.geometry.cost
    }

    /// Cost of the acceleration structures of moving bodies, summed over frames.
    pub fn moving_cost(&self) -> MovingCost {
        self.tracer.moving_cost()
    }

    /// Bytes of the acceleration structures, by content.
    #[cfg(test)]
    pub fn accel_memory(&self) -> AccelMemory {
        AccelMemory {
            map: self.geometry.bytes(),
            ..self.tracer.accel.memory()
        }
    }

    /// The linear picture of the last view, before exposure: RGBA, 32-bit floats.
    pub fn hdr(&self) -> Option<&Image> {
        self.tracer.hdr()
    }
}
