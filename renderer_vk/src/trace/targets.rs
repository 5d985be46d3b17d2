//! The images of the traced look.

use crate::gpu::{Device, Error, Format, Image, ImageUsage};

/// Images of one size: the G-buffer, the light, the picture before tone mapping, and the accumulated sum.
pub struct Targets {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// World position and length of the way from the eye.
    pub position: Image,
    /// Packed normals and albedo.
    pub surface: Image,
    /// Radiance of what is in front of the surface and of its own glow; alpha: what comes through of the background.
    pub front: Image,
    /// Direct light.
    pub direct: Image,
    /// Bounced light.
    pub indirect: Image,
    /// Linear picture.
    pub hdr: Image,
    /// Sum of frames in reference mode.
    pub accumulation: Image,
}

impl Targets {
    /// Makes the images; their contents are undefined.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, width: u32, height: u32) -> Result<Self, Error> {
        let make = |name, format| {
            let usage = ImageUsage::STORAGE;
            Image::new(
                device,
                &crate::gpu::ImageDesc::new(name, width, height, format, usage),
            )
        };
        Ok(Self {
            width,
            height,
            position: make("trace position", Format::Rgba32F)?,
            surface: make("trace surface", Format::Rgba32Uint)?,
            front: make("trace front", Format::Rgba32F)?,
            direct: make("trace direct", Format::Rgba16F)?,
            indirect: make("trace indirect", Format::Rgba16F)?,
            hdr: make("trace hdr", Format::Rgba32F)?,
            accumulation: make("trace accumulation", Format::Rgba32F)?,
        })
    }
}
