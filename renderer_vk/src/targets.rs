//! Target images of a frame, according to the settings.

use crate::Error;
use crate::gpu::{self, Access, Device, Format, Image, ImageDesc, ImageUsage, Recorder};
use crate::raster;
use crate::settings::{Look, ModelShadows, Settings};

/// Colour and depth of a frame.
pub struct FrameTargets {
    /// The picture, one sample a pixel.
    color: Image,
    /// Multisampled colour target of the classic look, if enabled.
    several: Option<Image>,
    /// Depth target of the classic look.
    depth: Image,
}

impl FrameTargets {
    /// Images of a size in pixels, without stencil and multisampling, in [`raster::COLOR_FORMAT`].
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(device: &Device, width: u32, height: u32) -> Result<Self, Error> {
        let (width, height) = (width.max(1), height.max(1));
        let color = color_image(device, width, height, raster::COLOR_FORMAT)?;
        Ok(Self {
            depth: depth_image(device, &color, 1, false)?,
            color,
            several: None,
        })
    }

    /// Makes images anew whose settings have changed: multisampled with `r_ext_multisample` if nothing is traced, with
    /// a stencil while shadow volumes are drawn. `format` is the colour format; only [`raster::COLOR_FORMAT`] and
    /// [`raster::WIDE_FORMAT`] support writes of compute and ray tracing shaders.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn fit(
        &mut self,
        device: &Device,
        settings: &Settings,
        format: Format,
    ) -> Result<(), Error> {
        if self.color.format() != format {
            self.color = color_image(device, self.color.width(), self.color.height(), format)?;
            self.several = None;
        }
        let wanted = if settings.rt == Look::Traced {
            0
        } else {
            settings.multisample
        };
        let stencil = settings.shadows == ModelShadows::Volumes;
        let samples = samples(device, wanted, stencil);
        let drawn = self.drawn().samples();
        if samples != drawn {
            self.several = None;
            if samples > 1 {
                let (width, height) = (self.color.width(), self.color.height());
                let usage = ImageUsage::COLOR;
                let desc = ImageDesc {
                    samples,
                    ..ImageDesc::new("frame samples", width, height, format, usage)
                };
                let several = Image::new(device, &desc)?;
                clear(device, &several)?;
                self.several = Some(several);
            }
        }
        if samples != self.depth.samples() || stencil != self.depth.format().has_stencil() {
            self.depth = depth_image(device, &self.color, samples, stencil)?;
        }
        Ok(())
    }

    /// The resolved picture.
    pub fn color(&self) -> &Image {
        &self.color
    }

    /// The colour target of the classic look.
    pub fn drawn(&self) -> &Image {
        self.several.as_ref().unwrap_or(&self.color)
    }

    /// The depth target of the classic look.
    pub fn depth(&self) -> &Image {
        &self.depth
    }

    /// Records clearing the picture to black.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn clear(&self, recorder: &mut Recorder) -> Result<(), gpu::Error> {
        let mut pass = recorder.pass("clear frame", Access::TRANSFER, Access::TRANSFER)?;
        pass.clear_image(self.drawn(), BLACK);
        Ok(())
    }

    /// Records resolving the samples into the picture.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn resolve(&self, recorder: &mut Recorder) -> Result<(), gpu::Error> {
        if let Some(several) = &self.several {
            let mut pass = recorder.pass("resolve", Access::TRANSFER, Access::TRANSFER)?;
            pass.resolve_image(several, &self.color);
        }
        Ok(())
    }
}

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A black image for the picture: neither the game nor the engine clears it before the first frame.
fn color_image(
    device: &Device,
    width: u32,
    height: u32,
    format: Format,
) -> Result<Image, gpu::Error> {
    // Without the usage of sampled textures: the validation layer assumes that every draw reads all sampled textures,
    // and would report a target among them as a hazard.
    let usage = if [raster::COLOR_FORMAT, raster::WIDE_FORMAT].contains(&format) {
        ImageUsage::COLOR | ImageUsage::STORAGE
    } else {
        ImageUsage::COLOR
    };
    let desc = ImageDesc::new("frame colour", width, height, format, usage);
    let color = Image::new(device, &desc)?;
    clear(device, &color)?;
    Ok(color)
}

fn clear(device: &Device, image: &Image) -> Result<(), gpu::Error> {
    device.immediate(|recorder| {
        let mut pass = recorder.pass("clear frame", Access::NONE, Access::TRANSFER)?;
        pass.clear_image(image, BLACK);
        Ok(())
    })
}

/// Number of samples for a requested number: the next supported one, otherwise the largest supported one.
fn samples(device: &Device, wish: u32, stencil: bool) -> u32 {
    if wish < 2 {
        return 1;
    }
    let depth = device.depth_format(stencil);
    let can = |samples: &u32| {
        device.supports_samples(raster::COLOR_FORMAT, *samples)
            && device.supports_samples(depth, *samples)
    };
    let wish = wish.next_power_of_two();
    let mut sizes = [2, 4, 8].into_iter().filter(can);
    let more = sizes.clone().find(|size| *size >= wish);
    more.or_else(|| sizes.next_back()).unwrap_or(1)
}

/// A depth image of the size of `color`.
fn depth_image(
    device: &Device,
    color: &Image,
    samples: u32,
    stencil: bool,
) -> Result<Image, gpu::Error> {
    let format = device.depth_format(stencil);
    let (width, height) = (color.width(), color.height());
    Image::new(
        device,
        &ImageDesc {
            samples,
            ..ImageDesc::new("frame depth", width, height, format, ImageUsage::DEPTH)
        },
    )
}
