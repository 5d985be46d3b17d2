//! Targets of the classic look.

use crate::gpu::{ColorMask, Format, GraphicsDesc, Image};
use shaders::Spirv;

/// Target images of a view.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// Colour, 8 bits a channel.
    pub color: &'a Image,
    /// Depth, with or without stencil, with as many samples as the colour.
    pub depth: &'a Image,
    /// Channels to write.
    pub mask: ColorMask,
}

/// Properties of a target that pipelines depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TargetKind {
    /// Format of the colour image.
    pub color: Format,
    /// Format of the depth image.
    pub depth: Format,
    /// Samples a pixel.
    pub samples: u32,
    /// Channels to write.
    pub mask: ColorMask,
    /// Counts fragments (`r_measureOverdraw`).
    pub counted: bool,
}

impl TargetKind {
    /// A pipeline that draws to it: [`GraphicsDesc::new`].
    pub fn desc<'a>(
        self,
        name: &'a str,
        vertex: &'a Spirv,
        fragment: &'a Spirv,
    ) -> GraphicsDesc<'a> {
        GraphicsDesc {
            color: Some(self.color),
            depth: Some(self.depth),
            samples: self.samples,
            ..GraphicsDesc::new(name, vertex, fragment)
        }
    }
}

impl Target<'_> {
    /// The properties that pipelines depend on.
    pub fn kind(&self) -> TargetKind {
        TargetKind {
            color: self.color.format(),
            depth: self.depth.format(),
            samples: self.color.samples(),
            mask: self.mask,
            counted: false,
        }
    }
}
