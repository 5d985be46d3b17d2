//! The hybrid look (`r_rt 2`): the classic look's picture with shadows of models and of dynamic lights that rays find. Needs
//! the map's acceleration structures, but no lights of the map.

use std::sync::Arc;

use shaders::trace_types::{CameraView, HybridStep, SceneView, TraceView};
use shaders::types::{HybridReflection, HybridTexel, HybridView, RasterLight};

use super::accel::{Accel, AccelOutput, Top};
use super::frame_passes::{FrameFacts, FramePasses};
use super::geometry::StaticGeometry;
use super::look::{remapping, static_scene};
use super::pass_set::PassSet;
use super::passes::{Pass, Resource};
use super::tracer::Tracer;
use crate::assets::Assets;
use crate::gpu::{Buffer, BufferDesc, BufferUsage, Device, Error, Memory, Recorder};
use crate::raster::{HybridImages, ViewParameters, raster_light};
use crate::scene::{ClassicScene, TracedScene, View};
use crate::trace::input::MaterialTable;
use crate::world::World;

/// Most dynamic lights of a view, as in the classic look.
const MAX_LIGHTS: usize = 32;

/// Images and results of one view.
struct Targets {
    size: [u32; 2],
    images: HybridImages,
    /// Texels, and texels between the steps of their filter.
    texels: [Buffer; 2],
    /// Only with images of reflecting surfaces.
    reflections: Option<Buffer>,
}

impl Targets {
    fn new(device: &Device, size: [u32; 2], mirrors: bool) -> Result<Self, Error> {
        let images = HybridImages::new(device, size, mirrors)?;
        let count = u64::from(images.surfaces.width()) * u64::from(images.surfaces.height());
        let buffer = |name, of_each: usize| {
            Buffer::new(
                device,
                &BufferDesc {
                    name,
                    size: count * of_each as u64,
                    usage: BufferUsage::STORAGE,
                    memory: Memory::Device,
                },
            )
        };
        let of_texel = size_of::<HybridTexel>();
        Ok(Self {
            size,
            texels: [
                buffer("hybrid texels", of_texel)?,
                buffer("hybrid texels between", of_texel)?,
            ],
            reflections: match mirrors {
                true => Some(buffer("hybrid reflections", size_of::<HybridReflection>())?),
                false => None,
            },
            images,
        })
    }
}

/// The hybrid look of one map.
pub struct HybridLook {
    passes: Arc<PassSet>,
    /// `rt_gridCells`.
    grid_cells: u32,
    geometry: StaticGeometry,
    accel: Accel,
    targets: Option<Targets>,
    /// Remapping of the materials at the time when `geometry` was built.
    remapping: u64,
}

/// The scene of a frame's hybrid views on the GPU.
#[derive(Clone, Copy)]
pub struct HybridScene {
    accel: AccelOutput,
    time: f32,
}

/// A hybrid view whose surfaces are drawn.
pub struct HybridInput<'a> {
    /// The scene that its rays traverse.
    pub traversed: HybridScene,
    /// The view.
    pub scene: &'a ClassicScene,
    /// Parameters of its draws.
    pub parameters: &'a ViewParameters<'a>,
    /// Some surfaces of it reflect.
    pub mirrors: bool,
}

impl HybridLook {
    /// Builds the map's acceleration structures. `grid_cells`: `rt_gridCells`.
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
        passes.compile_missing(
            [Pass::HybridShadows, Pass::HybridFilter]
                .map(|p| (p, 0))
                .into_iter(),
        )?;
        Ok(Self {
            passes: Arc::clone(passes),
            grid_cells,
            geometry: geometry(device, (tracer, grid_cells), world, assets)?,
            accel: Accel::with_models(device, tracer),
            targets: None,
            remapping: remapping(&assets.materials),
        })
    }

    /// The tracer.
    pub fn tracer(&self) -> Tracer {
        self.passes.tracer()
    }

    /// Builds the acceleration structures of the frame.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn begin(
        &mut self,
        rec: &mut Recorder,
        scene: &TracedScene,
        world: &World,
        assets: &Assets,
    ) -> Result<HybridScene, Error> {
        let remapping = remapping(&assets.materials);
        if remapping != self.remapping {
            let structures = (self.tracer(), self.grid_cells);
            self.geometry = geometry(rec.device(), structures, world, assets)?;
            self.remapping = remapping;
        }
        let map = scene.has_world.then_some(&self.geometry);
        Ok(HybridScene {
            accel: self.accel.record(rec, scene, map, assets)?,
            time: scene.time,
        })
    }

    /// Drops the images, until a view needs them again.
    pub fn drop_images(&mut self) {
        self.targets = None;
    }

    /// The images of a picture of a size in pixels. `mirrors`: some surfaces reflect.
    ///
    /// # Errors
    /// Out of memory.
    pub fn images(&mut self, size: [u32; 2], mirrors: bool) -> Result<&HybridImages, Error> {
        let kept = self.targets.take().filter(|targets| {
            targets.size == size && (targets.images.mirrors.is_some() || !mirrors)
        });
        let targets = match kept {
            Some(targets) => targets,
            None => Targets::new(self.passes.device(), size, mirrors)?,
        };
        Ok(&self.targets.insert(targets).images)
    }

    /// Traces from the surfaces in the images; returns the address of the `HybridView` for the view's draws, or 0 before
    /// [`images`](Self::images).
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn trace(
        &mut self,
        rec: &mut Recorder,
        input: HybridInput<'_>,
        assets: &Assets,
    ) -> Result<u64, Error> {
        let HybridInput {
            traversed: scene,
            scene: view,
            parameters: p,
            mirrors,
        } = input;
        let Some(targets) = &self.targets else {
            return Ok(0);
        };
        let lights = view.dlights.iter().take(MAX_LIGHTS);
        let lights: Vec<RasterLight> = lights.map(raster_light).collect();
        let [texels, between] = targets.texels.each_ref().map(Buffer::address);
        let reflections = targets.reflections.as_ref().filter(|_| mirrors);
        let hybrid = HybridView {
            texels,
            between,
            reflections: reflections.map_or(0, Buffer::address),
            lights: rec.arena().push(&lights)?,
            light_count: lights.len() as u32,
            ..targets.images.view(p)
        };
        let (width, height) = (hybrid.width, hybrid.height);
        let of = |top: Top| TraceView {
            materials: MaterialTable::buffers(assets),
            scene: SceneView {
                geometries: scene.accel.geometries,
                instances: scene.accel.instances,
                skies: self.geometry.skies.address(),
                mapped_vertices: self.geometry.mapped_vertices,
                nodes: top.nodes,
                placed: top.placed,
                top_level: top.scene,
                time: scene.time,
                sky_sampler: assets.sky_sampler(),
                sky_distance: view.view.sky_distance(),
                ..SceneView::default()
            },
            camera: camera(&view.view, height),
            width,
            height,
            ..TraceView::default()
        };
        let step = HybridStep {
            view: rec.arena().push(&[of(scene.accel.top)])?,
            models: rec.arena().push(&[of(scene.accel.models)])?,
            hybrid: rec.arena().push(&[hybrid])?,
            ..HybridStep::default()
        };
        let facts = FrameFacts {
            traced: [width, height],
            ..FrameFacts::default()
        };
        let mut passes = FramePasses::new(&self.passes, rec, step.view, facts);
        passes.wrote(Resource::HybridSurfaces);
        passes.record(Pass::HybridShadows, &step)?;
        if reflections.is_some() {
            passes.record(Pass::HybridReflections, &step)?;
        }
        for number in 0..2 {
            passes.record(Pass::HybridFilter, &HybridStep { number, ..step })?;
        }
        Ok(step.hybrid)
    }
}

/// Structures of the map's constant geometry.
fn geometry(
    device: &Device,
    structures: (Tracer, u32),
    world: &World,
    assets: &Assets,
) -> Result<StaticGeometry, Error> {
    let scene = static_scene(world, &world.data.fogs);
    StaticGeometry::new(device, structures, &scene, assets)
}

/// The camera of a view whose rays start at `height` rows of pixels.
fn camera(view: &View, height: u32) -> CameraView {
    let [forward, left, up] = view.axis;
    CameraView {
        origin: view.origin,
        forward,
        left: left * view.tan_x,
        up: up * view.tan_y,
        pixel_spread: 2.0 * view.tan_y / height.max(1) as f32,
        near: view.near,
        ..CameraView::default()
    }
}
