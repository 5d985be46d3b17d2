//! Stencil shadows of the classic look (`cg_shadows 2`): shadow volumes change the stencil, then one draw darkens the
//! pixels inside.
//!
//! Source: engine behaviour of `renderer_opengl1` (stencil shadows).

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::cover::{self, CoverParameters};
use super::target::TargetKind;
use crate::gpu::{
    self, Buffer, ColorMask, Cull, Device, GraphicsDesc, GraphicsPipeline, Pass, Recorder, Stencil,
    Viewport,
};
use crate::scene::{ShadowVolumes, View};

/// Brightness factor in shadow.
const SHADE: f32 = 0.6;
/// Distance from the camera at which the engine draws the shade, units; nearer surfaces stay bright.
const SHADE_DISTANCE: f32 = 10.0;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct VolumeParameters {
    world_to_clip: [[f32; 4]; 4],
    clip_plane: [f32; 4],
    positions: u64,
}

/// The pipelines of a kind of target.
struct Made {
    /// For faces of counter-clockwise and of clockwise winding, each incrementing and decrementing.
    up: [GraphicsPipeline; 2],
    down: [GraphicsPipeline; 2],
    shade: GraphicsPipeline,
}

impl Made {
    fn new(device: &Device, target: TargetKind) -> Result<Self, gpu::Error> {
        let volume = |stencil, cull| {
            GraphicsPipeline::new(
                device,
                &GraphicsDesc {
                    stencil: Some(stencil),
                    depth_write: false,
                    color_write: ColorMask::NONE,
                    cull,
                    ..target.desc(
                        "shadow volumes",
                        &shaders::RASTER_SHADOW_VERT,
                        &shaders::RASTER_SHADOW_FRAG,
                    )
                },
            )
        };
        Ok(Self {
            up: [
                volume(Stencil::Increment, Cull::Back)?,
                volume(Stencil::Increment, Cull::Front)?,
            ],
            down: [
                volume(Stencil::Decrement, Cull::Front)?,
                volume(Stencil::Decrement, Cull::Back)?,
            ],
            shade: cover::pipeline(device, target, cover::Kind::Shade)?,
        })
    }
}

/// Draws [`ShadowVolumes`].
#[derive(Default)]
pub struct Shadows {
    made: HashMap<TargetKind, Made>,
}

/// Shadow volumes in GPU memory.
pub struct Uploaded {
    positions: u64,
    indices: (Buffer, u64),
}

impl Shadows {
    /// Creates the pipelines for [`draw`](Self::draw).
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn prepare(
        &mut self,
        recorder: &mut Recorder,
        device: &Device,
        target: TargetKind,
        volumes: &ShadowVolumes,
    ) -> Result<Uploaded, gpu::Error> {
        if let Entry::Vacant(place) = self.made.entry(target) {
            place.insert(Made::new(device, target)?);
        }
        let arena = recorder.arena();
        let positions = arena.push(&volumes.positions)?;
        let indices = arena.push_indices(&volumes.indices)?;
        Ok(Uploaded { positions, indices })
    }

    /// Draws the volumes of a view over its picture, then the shade. The stencil must be clear.
    pub fn draw(
        &self,
        pass: &mut Pass<'_>,
        target: TargetKind,
        uploaded: &Uploaded,
        volumes: &ShadowVolumes,
        view: &View,
    ) {
        let Some(made) = self.made.get(&target) else {
            debug_assert!(false, "volumes are drawn that were not uploaded");
            return;
        };
        let [x, y, width, height] = view.viewport.map(|v| v as f32);
        pass.set_viewport(&Viewport {
            x,
            y: y + super::EDGE_SHIFT,
            width,
            height,
            min_depth: 0.0,
            max_depth: 1.0,
        });
        let (buffer, offset) = &uploaded.indices;
        pass.bind_index_buffer(buffer, *offset);
        let parameters = VolumeParameters {
            world_to_clip: view.world_to_clip.to_cols_array_2d(),
            clip_plane: view.clip_plane.map_or([0.0; 4], |plane| plane.to_array()),
            positions: uploaded.positions,
        };
        let mirrored = usize::from(view.mirrored);
        for &(first, count) in &volumes.ranges {
            for pipeline in [&made.up, &made.down] {
                if let Some(pipeline) = pipeline.get(mirrored) {
                    pass.bind_graphics(pipeline);
                    pass.push(&parameters);
                    pass.draw_indexed(count, 1, first, 0, 0);
                }
            }
        }
        pass.bind_graphics(&made.shade);
        pass.push(&CoverParameters {
            color: [SHADE, SHADE, SHADE, 1.0],
            depth: shade_depth(view),
        });
        pass.draw(3, 1, 0, 0);
    }
}

/// Depth of the shade.
fn shade_depth(view: &View) -> f32 {
    let point: Vec3 = view.origin + view.axis[0] * SHADE_DISTANCE;
    let clip = view.world_to_clip * point.extend(1.0);
    if clip.w > 0.0 {
        (clip.z / clip.w).clamp(0.0, 1.0)
    } else {
        0.0
    }
}
