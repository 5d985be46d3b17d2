//! Where the classic look draws.

use crate::gpu::{ColorMask, Format, Image};

/// Where a view is drawn.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// Colour, 8 bits a channel.
    pub color: &'a Image,
    /// Depth, with a stencil or without, with as many samples as the colour.
    pub depth: &'a Image,
    /// Channels that are drawn.
    pub mask: ColorMask,
}

/// What pipelines are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TargetKind {
    /// Format of the colour image.
    pub color: Format,
    /// Format of the depth image.
    pub depth: Format,
    /// Samples of a pixel.
    pub samples: u32,
    /// Channels that are drawn.
    pub mask: ColorMask,
    /// Fragments are counted (`r_measureOverdraw`).
    pub counted: bool,
}

impl Target<'_> {
    /// What pipelines for it are made for.
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
