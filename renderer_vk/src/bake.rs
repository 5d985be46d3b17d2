//! Light at points of a map on the GPU, for map tools: [`relight::bake::Gather`] without a window and without frames.

mod images;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::Vec3;
use relight::bake::{Gather, GatherError, GatherProgress, Light, LitSurfaces, Point};
use relight::calibrate::Surroundings;
use relight::{GameFiles, Materials, RelitWorld, WorldSurface};

use crate::assets::Assets;
use crate::error::Error;
use crate::gpu::{
    self, Buffer, BufferUsage, Device, DeviceInfo, DeviceOptions, FrameRing, SurfaceSource,
};
use crate::renderer::{FRAMES_IN_FLIGHT, KeptPipelines};
use crate::settings::{Settings, TracerChoice};
use crate::trace::bake::{BakeScene, Baker, Shared};
use crate::trace::bake_passes::BakePasses;
use crate::trace::geometry::StaticGeometry;
use crate::trace::input::{StaticScene, StaticSurface};
use crate::trace::lights::MapLightSource;
use crate::trace::tracer::Tracer;
use crate::world::{Occluding, WorldOptions};
use images::BakeImages;

/// Options of a [`BakeDevice`].
#[derive(Clone, Debug, Default)]
pub struct GatherOptions {
    /// Part of the name of the preferred device.
    pub device: Option<String>,
    /// Enables Vulkan's validation layer.
    pub validation: bool,
    /// How rays are traced.
    pub tracer: TracerChoice,
    /// File that keeps the driver's pipeline cache between runs.
    pub pipeline_cache: Option<PathBuf>,
}

/// A GPU with the compiled passes of bakes. Any number of maps share it, each with a [`GpuGather`] in a thread of its own:
/// their work is done in turn, a call at a time.
pub struct BakeDevice {
    // fields are dropped in this order: objects of the device before the device
    work: Mutex<Work>,
    tracer: Tracer,
    device: Device,
}

/// What one thread at a time uses.
struct Work {
    passes: BakePasses,
    ring: FrameRing,
    kept: KeptPipelines,
}

/// Computes light at points of one world on a GPU.
pub struct GpuGather {
    baker: Baker,
    /// What casts shadows.
    geometry: StaticGeometry,
    /// What reflects light, if more than casts shadows.
    reflecting: Option<StaticGeometry>,
    assets: Assets,
    _vertices: Buffer,
    on: Arc<BakeDevice>,
}

/// Whether the world's materials let light pass through a surface; for compiled lights these follow the compiler's rules.
fn is_passed(world: &RelitWorld, surface: u32) -> bool {
    let surface = world.surfaces.get(surface as usize);
    let material = surface.and_then(|surface| world.material_of(surface));
    material.is_some_and(|m| m.class.passed && m.holes.is_none() && !m.is_sky())
}

/// The map's own geometry that casts shadows, or all that reflects light; brush models are left out, as map compilers do it.
fn static_scene<'a>(
    world: &'a RelitWorld,
    occluding: &'a Occluding,
    vertex_address: u64,
    reflects: bool,
) -> StaticScene<'a> {
    let surfaces = occluding.surfaces.iter().zip(0..);
    let casts = |surface: &WorldSurface| reflects || world.casts_shadow(surface);
    let wanted = |number: u32| {
        let surface = world.surfaces.get(number as usize);
        surface.is_none_or(casts) && !is_passed(world, number)
    };
    StaticScene {
        vertices: &occluding.vertices,
        vertex_address,
        mapped_address: 0,
        indices: &world.indices,
        surfaces: surfaces
            .filter(|(s, number)| s.index_count > 0 && s.model == 0 && wanted(*number))
            .map(|(s, number)| StaticSurface {
                first_index: s.first_index,
                index_count: s.index_count,
                material: s.material,
                fog: 0,
                lightmap: s.lightmap,
                model: 0,
                number,
                curved: s.kind == q3bsp::SurfaceKind::Patch,
            })
            .collect(),
        fogs: &[],
    }
}

/// Radiance of each triangle of the geometry as a light of the sky; empty without such lights.
fn sky_light(world: &RelitWorld, geometry: &StaticGeometry) -> Vec<Vec3> {
    if !world.lights.iter().any(|light| light.is_sky) {
        return Vec::new();
    }
    let radiance = |&source: &u32| {
        let light = world.light_of_triangle(source as usize);
        light.map_or(Vec3::ZERO, |light| light.radiance)
    };
    geometry.sources.iter().map(radiance).collect()
}

impl BakeDevice {
    /// Finds a device.
    ///
    /// # Errors
    /// There is no Vulkan or no suitable device, or the device is out of memory.
    pub fn new(options: &GatherOptions) -> Result<Self, Error> {
        let (kept, pipeline_cache) = KeptPipelines::read(options.pipeline_cache.clone());
        let device_options = DeviceOptions {
            app_name: "Relight".into(),
            validation: options.validation,
            prefer: options.device.clone(),
            pipeline_cache,
            ..DeviceOptions::default()
        };
        let device = Device::new(&device_options, SurfaceSource::Headless)?;
        let tracer = Tracer::of(device.info(), options.tracer);
        let work = Work {
            passes: BakePasses::new(&device, tracer),
            ring: FrameRing::new(&device, FRAMES_IN_FLIGHT)?,
            kept,
        };
        Ok(Self {
            work: Mutex::new(work),
            tracer,
            device,
        })
    }

    /// Compiles the passes, which their first use does otherwise, and keeps the driver's pipeline cache.
    ///
    /// # Errors
    /// The driver refuses a pipeline, or the device is out of memory.
    pub fn compile(&self) -> Result<(), Error> {
        let mut work = self.turn();
        work.passes.all()?;
        work.kept.write(&self.device);
        Ok(())
    }

    /// The device in use.
    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Messages of the validation layer so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }

    /// Waits for its turn.
    fn turn(&self) -> MutexGuard<'_, Work> {
        // a call that panicked has left no frame open
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl GpuGather {
    /// Uploads a world with the images of its cut-outs. `scripts`: those of `files`.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(
        on: &Arc<BakeDevice>,
        files: Arc<dyn GameFiles>,
        scripts: Arc<Materials>,
        world: &RelitWorld,
    ) -> Result<Self, Error> {
        // uploads are submitted with the work of their turn
        let _turn = on.turn();
        Ok(Self::upload(on, files, scripts, world)?)
    }

    fn upload(
        on: &Arc<BakeDevice>,
        files: Arc<dyn GameFiles>,
        scripts: Arc<Materials>,
        world: &RelitWorld,
    ) -> Result<Self, gpu::Error> {
        let BakeDevice { tracer, device, .. } = &**on;
        let settings = Settings::default();
        let mut assets = Assets::new(device, files, scripts, &settings)?;
        let options = WorldOptions::new(&settings);
        let materials = &mut assets.materials;
        let mut images = BakeImages::new(&mut assets.textures, world);
        let occluding = Occluding::new(world, materials, &mut images, &options);
        for warning in materials.set_by_hand(world.by_hand.clone(), &mut images) {
            log::warn!("{}: {warning}", world.name);
        }
        assets.prepare_frame(&settings)?;
        let vertices = Buffer::with_data(
            device,
            "world vertices",
            BufferUsage::STORAGE,
            &occluding.vertices,
        )?;
        let structures = (*tracer, settings.rt_grid_cells);
        let geometry = |reflects| {
            let scene = static_scene(world, &occluding, vertices.address(), reflects);
            StaticGeometry::new(device, structures, &scene, &assets)
        };
        let reflecting = match world.has_shadowless() {
            true => Some(geometry(true)?),
            false => None,
        };
        let geometry = geometry(false)?;
        let lights = MapLightSource {
            triangles: &world.lights,
            points: &world.point_lights,
            suns: &world.suns,
            light_cutoff: world.light_cutoff,
            cutoff_of_points: world.has_compiled_lights,
            bsp: Some(&world.bsp),
            ..MapLightSource::empty(&world.light_lists)
        };
        let sky_light = sky_light(world, &geometry);
        Ok(Self {
            baker: Baker::new(device, *tracer, &lights, &sky_light)?,
            geometry,
            reflecting,
            assets,
            _vertices: vertices,
            on: Arc::clone(on),
        })
    }

    /// Computes with the passes in this map's turn. `reflects`: rays meet all that reflects light, not what casts shadows.
    fn compute<T>(
        &mut self,
        reflects: bool,
        call: impl FnOnce(&mut Baker, &mut Shared<'_>, BakeScene<'_>) -> Result<T, gpu::Error>,
    ) -> Result<T, GatherError> {
        let mut turn = self.on.turn();
        let Work { passes, ring, .. } = &mut *turn;
        let reflecting = self.reflecting.as_ref().filter(|_| reflects);
        let scene = BakeScene {
            geometry: reflecting.unwrap_or(&self.geometry),
            materials: &self.assets,
        };
        call(&mut self.baker, &mut Shared { ring, passes }, scene)
            .map_err(|error| GatherError(error.to_string()))
    }
}

impl Gather for GpuGather {
    fn name(&self) -> String {
        self.on.info().name.clone()
    }

    fn direct(
        &mut self,
        points: &[Point],
        samples: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        self.compute(false, |baker, shared, scene| {
            baker.direct(shared, scene, points, samples, progress)
        })
    }

    fn reflected(
        &mut self,
        points: &[Point],
        lit: LitSurfaces<'_>,
        rays: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        self.compute(true, |baker, shared, scene| {
            baker.reflected(shared, scene, points, (&lit, rays), progress)
        })
    }

    fn nearness(
        &mut self,
        points: &[Point],
        around: &Surroundings,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<f32>, GatherError> {
        self.compute(false, |baker, shared, scene| {
            baker.nearness(shared, scene, points, around, progress)
        })
    }
}
