//! Light at points of a map on the GPU, for map tools: [`relight::bake::Gather`] without a window and without frames.

use std::sync::Arc;

use glam::Vec3;
use relight::bake::{Gather, GatherError, GatherProgress, Light, LitSurfaces, Point};
use relight::{GameFiles, RelitWorld};

use crate::assets::Assets;
use crate::error::Error;
use crate::gpu::{
    self, Buffer, BufferUsage, Device, DeviceInfo, DeviceOptions, FrameRing, SurfaceSource,
};
use crate::renderer::FRAMES_IN_FLIGHT;
use crate::settings::{Settings, TracerChoice};
use crate::trace::bake::{BakeScene, Baker};
use crate::trace::geometry::StaticGeometry;
use crate::trace::input::{StaticScene, StaticSurface};
use crate::trace::lights::MapLightSource;
use crate::trace::tracer::Tracer;
use crate::world::{Occluding, WorldOptions};

/// Options of a [`GpuGather`].
#[derive(Clone, Debug, Default)]
pub struct GatherOptions {
    /// Part of the name of the preferred device.
    pub device: Option<String>,
    /// Enables Vulkan's validation layer.
    pub validation: bool,
    /// How rays are traced.
    pub tracer: TracerChoice,
}

/// Computes light at points of one world on a GPU.
pub struct GpuGather {
    // fields are dropped in this order: objects of the device before the device
    baker: Baker,
    geometry: StaticGeometry,
    assets: Assets,
    _vertices: Buffer,
    ring: FrameRing,
    device: Device,
}

/// Whether the world's materials let light pass through a surface; for compiled lights these follow the compiler's rules.
fn is_passed(world: &RelitWorld, surface: u32) -> bool {
    let surface = world.surfaces.get(surface as usize);
    let material = surface.and_then(|surface| world.material_of(surface));
    material.is_some_and(|m| m.class.passed && m.holes.is_none() && !m.is_sky())
}

/// The map's own geometry; brush models cast no shadow, as with map compilers.
fn static_scene<'a>(
    world: &'a RelitWorld,
    occluding: &'a Occluding,
    vertex_address: u64,
) -> StaticScene<'a> {
    let surfaces = occluding.surfaces.iter().zip(0..);
    StaticScene {
        vertices: &occluding.vertices,
        vertex_address,
        mapped_address: 0,
        indices: &world.indices,
        surfaces: surfaces
            .filter(|(s, number)| s.index_count > 0 && s.model == 0 && !is_passed(world, *number))
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

impl GpuGather {
    /// Finds a device, and uploads a world with the images of its materials.
    ///
    /// # Errors
    /// There is no Vulkan or no suitable device, or the device is out of memory.
    pub fn new(
        options: &GatherOptions,
        files: Arc<dyn GameFiles>,
        world: &RelitWorld,
    ) -> Result<Self, Error> {
        let device_options = DeviceOptions {
            app_name: "Relight".into(),
            validation: options.validation,
            prefer: options.device.clone(),
            ..DeviceOptions::default()
        };
        let device = Device::new(&device_options, SurfaceSource::Headless)?;
        Ok(Self::on(&device, options.tracer, files, world)?)
    }

    fn on(
        device: &Device,
        tracer: TracerChoice,
        files: Arc<dyn GameFiles>,
        world: &RelitWorld,
    ) -> Result<Self, gpu::Error> {
        let settings = Settings::default();
        let scripts = Arc::new(relight::Materials::load(&*files).0);
        let mut assets = Assets::new(device, files, scripts, &settings)?;
        let options = WorldOptions::new(&settings);
        let (materials, textures) = (&mut assets.materials, &mut assets.textures);
        let occluding = Occluding::new(world, materials, textures, &options);
        for warning in materials.set_by_hand(world.by_hand.clone(), textures) {
            log::warn!("{}: {warning}", world.name);
        }
        assets.prepare_frame(&settings)?;
        let vertices = Buffer::with_data(
            device,
            "world vertices",
            BufferUsage::STORAGE,
            &occluding.vertices,
        )?;
        let scene = static_scene(world, &occluding, vertices.address());
        let tracer = Tracer::of(device.info(), tracer);
        let structures = (tracer, settings.rt_grid_cells);
        let geometry = StaticGeometry::new(device, structures, &scene, &assets)?;
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
            baker: Baker::new(device, tracer, &lights, &sky_light)?,
            geometry,
            assets,
            _vertices: vertices,
            ring: FrameRing::new(device, FRAMES_IN_FLIGHT)?,
            device: device.clone(),
        })
    }

    /// The device in use.
    pub fn device_info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Messages of the validation layer so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }
}

fn failure(error: gpu::Error) -> GatherError {
    GatherError(error.to_string())
}

impl Gather for GpuGather {
    fn name(&self) -> String {
        self.device.info().name.clone()
    }

    fn direct(
        &mut self,
        points: &[Point],
        samples: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        let scene = BakeScene {
            geometry: &self.geometry,
            materials: &self.assets,
        };
        (self.baker)
            .direct(&mut self.ring, scene, points, samples, progress)
            .map_err(failure)
    }

    fn reflected(
        &mut self,
        points: &[Point],
        lit: LitSurfaces<'_>,
        rays: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        let scene = BakeScene {
            geometry: &self.geometry,
            materials: &self.assets,
        };
        (self.baker)
            .reflected(&mut self.ring, scene, points, &lit, rays, progress)
            .map_err(failure)
    }
}
