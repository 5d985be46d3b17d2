//! One colour over the whole viewport, in some of its channels.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bytemuck::{Pod, Zeroable};

use super::target::TargetKind;
use crate::gpu::{
    self, BlendFactor, DepthTest, Device, GraphicsDesc, GraphicsPipeline, Pass, Stencil,
};

/// What `cover.vert` and `cover.frag` are given.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct CoverParameters {
    /// Colour.
    pub color: [f32; 4],
    /// Depth of the triangle that covers the viewport.
    pub depth: f32,
}

/// A pipeline that covers the viewport; with a shade, what is there is multiplied where the stencil is not 0 and the
/// depth is not nearer.
pub fn pipeline(
    device: &Device,
    target: TargetKind,
    shade: bool,
) -> Result<GraphicsPipeline, gpu::Error> {
    let multiply = (BlendFactor::DstColor, BlendFactor::Zero);
    GraphicsPipeline::new(
        device,
        &GraphicsDesc {
            color: Some(target.color),
            depth: Some(target.depth),
            samples: target.samples,
            stencil: shade.then_some(Stencil::NotZero),
            depth_test: if shade {
                DepthTest::LessEqual
            } else {
                DepthTest::Always
            },
            depth_write: shade,
            blend: shade.then_some(multiply),
            color_write: target.mask,
            ..GraphicsDesc::new(
                "cover",
                &shaders::RASTER_COVER_VERT,
                &shaders::RASTER_COVER_FRAG,
            )
        },
    )
}

/// Fills viewports.
#[derive(Default)]
pub struct Cover {
    made: HashMap<TargetKind, GraphicsPipeline>,
}

impl Cover {
    /// Makes what [`draw`](Self::draw) needs.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn prepare(&mut self, device: &Device, target: TargetKind) -> Result<(), gpu::Error> {
        if let Entry::Vacant(place) = self.made.entry(target) {
            place.insert(pipeline(device, target, false)?);
        }
        Ok(())
    }

    /// Fills the scissor's rectangle.
    pub fn draw(&self, pass: &mut Pass<'_>, target: TargetKind, color: [f32; 4]) {
        if let Some(pipeline) = self.made.get(&target) {
            pass.bind_graphics(pipeline);
            pass.push(&CoverParameters { color, depth: 0.0 });
            pass.draw(3, 1, 0, 0);
        }
    }
}
