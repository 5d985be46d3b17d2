//! The images of the traced look.

use crate::gpu::{Device, Error, Format, Image, ImageDesc, ImageUsage};

/// Images of one size: the G-buffer, the light, the picture before tone mapping, and the accumulated sum.
pub struct Targets {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// World position and length of the way from the eye; of this frame and the last.
    pub position: [Image; 2],
    /// Packed normals; of this frame and the last.
    pub surface: [Image; 2],
    /// Albedo, with all that lies between the eye and the surface.
    pub albedo: Image,
    /// Where the surface was in the last frame and how far away, see [`super::motion`]; of this frame and the last.
    pub motion: [Image; 2],
    /// Radiance of what is in front of the surface and of its own glow; alpha: the field of a pixel that shows either a
    /// reflection (2) or what lies behind it (1), otherwise 0.
    pub front: Image,
    /// Direct light.
    pub direct: Image,
    /// Bounced light.
    pub indirect: Image,
    /// Light that the denoiser works on, with its variance: the last frame's and two that change places.
    pub light: [Image; 3],
    /// Mean and mean square of the light's luminance over time, number of frames; of this frame and the last.
    pub moments: [Image; 2],
    /// Linear picture of the traced size.
    pub composite: Image,
    /// Mean of the frames in reference mode, while that is on.
    pub accumulation: Option<Image>,
}

impl Targets {
    /// Makes the images; their contents are undefined.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, width: u32, height: u32) -> Result<Self, Error> {
        let make = |name, format| {
            let usage = ImageUsage::STORAGE;
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        Ok(Self {
            width,
            height,
            position: [
                make("trace position", Format::Rgba32F)?,
                make("trace last position", Format::Rgba32F)?,
            ],
            surface: [
                make("trace surface", Format::Rg32Uint)?,
                make("trace last surface", Format::Rg32Uint)?,
            ],
            albedo: make("trace albedo", Format::Rgba16F)?,
            motion: [
                make("trace motion", Format::Rgba16F)?,
                make("trace last motion", Format::Rgba16F)?,
            ],
            light: [
                make("trace light 0", Format::Rgba16F)?,
                make("trace light 1", Format::Rgba16F)?,
                make("trace light 2", Format::Rgba16F)?,
            ],
            moments: [
                make("trace moments", Format::Rgba16F)?,
                make("trace last moments", Format::Rgba16F)?,
            ],
            front: make("trace front", Format::Rgba16F)?,
            direct: make("trace direct", Format::Rgba16F)?,
            indirect: make("trace indirect", Format::Rgba16F)?,
            composite: make("trace composite", Format::Rgba16F)?,
            accumulation: None,
        })
    }

    /// Makes or drops the image that only reference mode needs.
    ///
    /// # Errors
    /// Out of memory.
    pub fn fit(&mut self, device: &Device, accumulates: bool) -> Result<(), Error> {
        if !accumulates {
            self.accumulation = None;
        } else if self.accumulation.is_none() {
            let (name, format) = ("trace accumulation", Format::Rgba32F);
            let desc = ImageDesc::new(name, self.width, self.height, format, ImageUsage::STORAGE);
            self.accumulation = Some(Image::new(device, &desc)?);
        }
        Ok(())
    }

    /// The linear picture, as far as nothing is resolved over time.
    pub fn picture(&self) -> &Image {
        self.accumulation.as_ref().unwrap_or(&self.composite)
    }

    /// What this frame has written becomes what the last one wrote. `filtered`: the image of `light` that the next
    /// frame starts from.
    pub fn advance(&mut self, filtered: usize) {
        self.position.swap(0, 1);
        self.surface.swap(0, 1);
        self.motion.swap(0, 1);
        self.moments.swap(0, 1);
        self.light.swap(0, filtered.min(2));
    }
}
