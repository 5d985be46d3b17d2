//! Fills a rectangle with a colour, in some channels, or with a depth. Replaces clears in the middle of a frame: at a
//! clear between draws, software drivers finish all earlier drawing.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bytemuck::{Pod, Zeroable};

use super::target::TargetKind;
use crate::gpu::{
    self, BlendFactor, ColorMask, DepthTest, Device, GraphicsDesc, GraphicsPipeline, Pass, Stencil,
};

/// Push constants of `cover.vert` and `cover.frag`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct CoverParameters {
    /// Colour, if it is drawn.
    pub color: [f32; 4],
    /// Depth of the triangle that covers the viewport.
    pub depth: f32,
}

/// Kind of fill.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A colour.
    Color,
    /// A depth, which replaces the existing one.
    Depth,
    /// A colour, multiplied where the stencil is not 0 and the depth is not nearer.
    Shade,
}

/// A pipeline for a triangle that covers the viewport.
pub fn pipeline(
    device: &Device,
    target: TargetKind,
    kind: Kind,
) -> Result<GraphicsPipeline, gpu::Error> {
    let multiply = (BlendFactor::DstColor, BlendFactor::Zero);
    let shade = kind == Kind::Shade;
    GraphicsPipeline::new(
        device,
        &GraphicsDesc {
            stencil: shade.then_some(Stencil::NotZero),
            depth_test: if shade {
                DepthTest::LessEqual
            } else {
                DepthTest::Always
            },
            depth_write: kind != Kind::Color,
            blend: shade.then_some(multiply),
            color_write: match kind {
                Kind::Depth => ColorMask::NONE,
                _ => target.mask,
            },
            fragment: (kind != Kind::Depth).then_some(&shaders::RASTER_COVER_FRAG),
            ..target.desc(
                "cover",
                &shaders::RASTER_COVER_VERT,
                &shaders::RASTER_COVER_FRAG,
            )
        },
    )
}

/// Fills rectangles.
#[derive(Default)]
pub struct Cover {
    made: HashMap<(TargetKind, Kind), GraphicsPipeline>,
}

impl Cover {
    /// Creates the pipelines.
    ///
    /// # Errors
    /// The device is out of memory or cannot make a pipeline.
    pub fn prepare(
        &mut self,
        device: &Device,
        target: TargetKind,
        kind: Kind,
    ) -> Result<(), gpu::Error> {
        if let Entry::Vacant(place) = self.made.entry((target, kind)) {
            place.insert(pipeline(device, target, kind)?);
        }
        Ok(())
    }

    /// Fills the scissor rectangle with a colour. The viewport must be the whole image.
    pub fn color(&self, pass: &mut Pass<'_>, target: TargetKind, color: [f32; 4]) {
        let parameters = CoverParameters { color, depth: 0.0 };
        self.draw(pass, (target, Kind::Color), &parameters);
    }

    /// Fills the scissor rectangle with a depth. The viewport must be the whole image.
    pub fn depth(&self, pass: &mut Pass<'_>, target: TargetKind, depth: f32) {
        let color = [0.0; 4];
        self.draw(
            pass,
            (target, Kind::Depth),
            &CoverParameters { color, depth },
        );
    }

    fn draw(&self, pass: &mut Pass<'_>, key: (TargetKind, Kind), parameters: &CoverParameters) {
        if let Some(pipeline) = self.made.get(&key) {
            pass.bind_graphics(pipeline);
            pass.push(parameters);
            pass.draw(3, 1, 0, 0);
        }
    }
}
