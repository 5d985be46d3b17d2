//! Flares (`r_flares`): tested against the depth of the view that was just drawn, in the traced look by rays; then
//! faded and drawn over the view. All of this runs on the GPU without a read-back.
//!
//! Source: engine behaviour of `renderer_opengl1` (flares).

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec4};
use shaders::types::{Flare, FlareState, Vertex};

use super::target::{Target, TargetKind};
use crate::gpu::{
    self, Access, Buffer, BufferDesc, BufferUsage, ColorMask, ComputePipeline, Device,
    GraphicsDesc, GraphicsPipeline, Memory, Recorder, Rendering, Topology,
};
use crate::scene::{ClassicScene, DrawSurface, Geometry, ViewScene};

/// Invocations of a workgroup of `flare_fade.comp`.
const GROUP: u32 = 64;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct TestParameters {
    flares: u64,
    states: u64,
    size: [f32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct FadeParameters {
    flares: u64,
    states: u64,
    vertices: u64,
    count: u32,
    time: i32,
    speed: f32,
    padding: u32,
}

/// Identifies a flare in a view: surface, entity, number of the view in the frame, whether it is a portal's view.
type Key = (u32, u32, u32, bool);

/// Slot of a flare's state.
struct Slot {
    index: u32,
    /// Last frame that had the flare.
    frame: u64,
}

/// Evaluates flares, and keeps their states between frames.
pub struct Flares {
    device: Device,
    test: HashMap<TargetKind, GraphicsPipeline>,
    fade: Option<ComputePipeline>,
    states: Option<Buffer>,
    vertices: Option<Buffer>,
    slots: HashMap<Key, Slot>,
    free: Vec<u32>,
    /// Number of slots ever assigned.
    used: u32,
    frame: u64,
    /// Number of views in this frame.
    views: u32,
    flares: Vec<Flare>,
    quads: Option<ClassicScene>,
    /// The missing feature for the depth test was logged.
    warned: bool,
}

/// The flares of a view for the visibility test, which sets `seen` in the state of each visible flare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlareTest {
    /// Device address of the [`Flare`]s.
    pub flares: u64,
    /// Device address of the [`FlareState`]s, by slot.
    pub states: u64,
    /// Number of flares.
    pub count: u32,
}

impl Flares {
    /// No flares.
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            test: HashMap::new(),
            fade: None,
            states: None,
            vertices: None,
            slots: HashMap::new(),
            free: Vec::new(),
            used: 0,
            frame: 0,
            views: 0,
            flares: Vec::new(),
            quads: None,
            warned: false,
        }
    }

    /// Ends a frame of the game: drops flares that it did not have.
    pub fn end_frame(&mut self) {
        let frame = self.frame;
        let free = &mut self.free;
        self.slots.retain(|_, slot| {
            let keep = slot.frame == frame;
            if !keep {
                free.push(slot.index);
            }
            keep
        });
        self.frame += 1;
        self.views = 0;
    }

    /// Prepares the flares of the frame's next view for the test; without `count` there are none.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn begin(
        &mut self,
        recorder: &mut Recorder,
        scene: &ViewScene,
    ) -> Result<FlareTest, gpu::Error> {
        let view = self.views;
        self.views += 1;
        self.flares.clear();
        if scene.flares.is_empty() {
            return Ok(FlareTest::default());
        }
        self.place(scene, view);
        Ok(FlareTest {
            flares: recorder.arena().push(&self.flares)?,
            states: self.fit_states(recorder)?.address(),
            count: u32::try_from(self.flares.len()).unwrap_or(u32::MAX),
        })
    }

    /// Tests flares against the depth of the view just drawn to `target`. `false`: the device lacks a feature.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn test_depth(
        &mut self,
        recorder: &mut Recorder,
        target: Target<'_>,
        test: FlareTest,
    ) -> Result<bool, gpu::Error> {
        if !self.device.fragment_stores() {
            if !self.warned {
                log::warn!("flares are not drawn: the device cannot write from fragment shaders");
                self.warned = true;
            }
            return Ok(false);
        }
        let kind = target.kind();
        let pipeline = match self.test.entry(kind) {
            Entry::Occupied(made) => made.into_mut(),
            Entry::Vacant(place) => place.insert(test_pipeline(&self.device, kind)?),
        };
        let mut pass = recorder.pass("flare test", Access::GRAPHICS, Access::GRAPHICS)?;
        pass.begin_rendering(&Rendering {
            color: Some(target.color),
            depth: Some(target.depth),
            clear_color: None,
            clear_depth: None,
        })?;
        pass.bind_graphics(pipeline);
        pass.push(&TestParameters {
            flares: test.flares,
            states: test.states,
            size: [target.color.width() as f32, target.color.height() as f32],
        });
        pass.draw(test.count, 1, 0, 0);
        Ok(true)
    }

    /// Fades the tested flares and expands them to quads: returns the address of their vertices, four for each flare,
    /// and the view that draws them.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn finish(
        &mut self,
        recorder: &mut Recorder,
        test: FlareTest,
        scene: &ViewScene,
        material: u32,
        speed: f32,
    ) -> Result<(u64, &ClassicScene), gpu::Error> {
        let vertices = self.fit_vertices()?;
        let fade = match &mut self.fade {
            Some(fade) => fade,
            none => none.insert(ComputePipeline::new(
                &self.device,
                "flare fade",
                &shaders::RASTER_FLARE_FADE_COMP,
                &[],
            )?),
        };
        let mut pass = recorder.pass("flare fade", Access::COMPUTE, Access::COMPUTE)?;
        pass.bind_compute(fade);
        pass.push(&FadeParameters {
            flares: test.flares,
            states: test.states,
            vertices: vertices.address(),
            count: test.count,
            time: scene.def.time_ms,
            speed,
            padding: 0,
        });
        pass.dispatch(test.count.div_ceil(GROUP), 1, 1);
        drop(pass);

        let quads = self
            .quads
            .get_or_insert_with(|| ClassicScene::empty(&scene.def, scene.view));
        list_quads(quads, scene, material, test.count);
        Ok((vertices.address(), quads))
    }

    /// Appends the flares of the view with their slots to `flares`.
    fn place(&mut self, scene: &ViewScene, view: u32) {
        for found in &scene.flares {
            let key = (found.surface, found.instance, view, scene.view.is_portal);
            let (slot, fresh) = match self.slots.entry(key) {
                Entry::Occupied(known) => (known.into_mut(), 0),
                Entry::Vacant(place) => {
                    let index = self.free.pop().unwrap_or_else(|| {
                        self.used += 1;
                        self.used - 1
                    });
                    let frame = self.frame;
                    (place.insert(Slot { index, frame }), 1)
                }
            };
            slot.frame = self.frame;
            self.flares.push(Flare {
                slot: slot.index,
                fresh,
                ..found.flare
            });
        }
    }

    /// The buffer of states, large enough for all slots.
    fn fit_states(&mut self, recorder: &mut Recorder) -> Result<Buffer, gpu::Error> {
        let wanted = u64::from(self.used) * size_of::<FlareState>() as u64;
        if let Some(states) = self.states.as_ref().filter(|s| s.size() >= wanted) {
            return Ok(states.clone());
        }
        let size = wanted.next_power_of_two().max(4096);
        let grown = storage(&self.device, "flare states", size)?;
        let mut pass = recorder.pass("flare states", Access::TRANSFER, Access::TRANSFER)?;
        pass.fill_buffer(&grown, 0, size, 0);
        if let Some(old) = self.states.take() {
            pass.barrier();
            pass.copy_buffer(&old, 0, &grown, 0, old.size());
        }
        drop(pass);
        self.states = Some(grown.clone());
        Ok(grown)
    }

    /// A buffer for the quads of a view's flares.
    fn fit_vertices(&mut self) -> Result<Buffer, gpu::Error> {
        let wanted = (self.flares.len() * 4 * size_of::<Vertex>()) as u64;
        if let Some(vertices) = self.vertices.as_ref().filter(|v| v.size() >= wanted) {
            return Ok(vertices.clone());
        }
        let size = wanted.next_power_of_two().max(16384);
        let grown = storage(&self.device, "flare squares", size)?;
        self.vertices = Some(grown.clone());
        Ok(grown)
    }
}

fn storage(device: &Device, name: &str, size: u64) -> Result<Buffer, gpu::Error> {
    Buffer::new(
        device,
        &BufferDesc {
            name,
            size,
            usage: BufferUsage::STORAGE,
            memory: Memory::Device,
        },
    )
}

fn test_pipeline(device: &Device, target: TargetKind) -> Result<GraphicsPipeline, gpu::Error> {
    GraphicsPipeline::new(
        device,
        &GraphicsDesc {
            depth_write: false,
            color_write: ColorMask::NONE,
            topology: Topology::Points,
            ..target.desc(
                "flare test",
                &shaders::RASTER_FLARE_TEST_VERT,
                &shaders::RASTER_FLARE_TEST_FRAG,
            )
        },
    )
}

/// Fills `quads` with a view that draws the quads of `count` flares of `scene`.
fn list_quads(quads: &mut ClassicScene, scene: &ViewScene, material: u32, count: u32) {
    quads.view = scene.view;
    quads.view.clip_plane = None;
    quads.time = scene.time;
    quads.instances.clear();
    // the engine draws them as parts of the world
    quads.instances.extend(scene.instances.first());
    quads.indices.clear();
    for v in (0..count).map(|quad| quad * 4) {
        quads.indices.extend([v, v + 1, v + 2, v, v + 2, v + 3]);
    }
    quads.look.surfaces.clear();
    quads.look.surfaces.push(DrawSurface {
        sort_key: 0,
        material,
        instance: 0,
        fog: 0,
        lightmap: shaders::types::constants::NO_TEXTURE,
        dlights: 0,
        geometry: Geometry::Dynamic {
            first_index: 0,
            index_count: count * 6,
        },
        flat: false,
        distance_squared: 0.0,
    });
}

/// Window pixels to clip space, in the middle of the depth range, where the engine draws flares.
pub fn window_to_clip([x, y, width, height]: [i32; 4]) -> Mat4 {
    let (width, height) = (width.max(1) as f32, height.max(1) as f32);
    Mat4::from_cols(
        Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
        Vec4::ZERO,
        Vec4::new(
            -1.0 - 2.0 * x as f32 / width,
            -1.0 - 2.0 * y as f32 / height,
            0.5,
            1.0,
        ),
    )
}
