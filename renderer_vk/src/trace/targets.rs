//! The images of the traced look.

use shaders::trace_types::constants::RAY_TILE;

use crate::gpu::{
    Buffer, BufferDesc, BufferUsage, Device, Error, Format, Image, ImageDesc, ImageUsage, Memory,
};

/// A buffer with `bytes` bytes for each pixel of a size.
pub(super) fn texels(
    device: &Device,
    name: &str,
    size: [u32; 2],
    bytes: u64,
) -> Result<Buffer, Error> {
    let [width, height] = size.map(u64::from);
    Buffer::new(
        device,
        &BufferDesc {
            name,
            size: width * height * bytes,
            usage: BufferUsage::SCREEN,
            memory: Memory::Device,
        },
    )
}

/// Images of one size: the G-buffer, light, the picture before tone mapping, and the accumulated mean.
///
/// Formats are given with each image; colours are linear, lengths in units of the map. *Light* has four bytes: three
/// mantissas of nine bits with one exponent (`light_image.glsl`).
pub struct Targets {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 16 bytes a pixel that passes use in turns: primary hits, then sampled lights, then light that the denoiser
    /// filters.
    pub scratch: Buffer,
    /// `Rgba32F`: world position of the shown surface, and its view distance (negative: no surface to light; its lowest
    /// bit is set if only camera rays see the surface). Written by `primary_simple` and `primary`, read by all passes
    /// that light or filter.
    pub position: Image,
    /// `Rg32Uint`: geometric normal and shading normal, packed (`direction.glsl`). Written and read as `position` is.
    pub surface: Image,
    /// `Rg32Uint`, two of light: albedo times the transmission between camera and surface, and the radiance in front of
    /// the surface plus its own emission. Written by `primary_simple` and `primary`, read by `composite`.
    pub shown: Image,
    /// As `shown`, for pixels that show reflection and refraction alternately: the side that the pixel does not show.
    /// Written by `trace_other_side`.
    pub other: Image,
    /// `Rgba16F`: offset of the surface's pixel in the last frame (pixels, right and down), its view distance in that
    /// frame (negative: unknown), and the pixel's mark (`motion.glsl`). Read by the denoiser and by temporal
    /// antialiasing.
    pub motion: Image,
    /// `R16F`: view distance in this frame and in the last; negative where the surface moves in the picture.
    pub view_distance: [Image; 2],
    /// `R32Uint`, light: direct light of lamps and suns, without albedo; of this frame and the last. Written by
    /// `direct` and `suns`; the denoiser replaces it with the filtered light for `composite`.
    pub direct: [Image; 2],
    /// Bounced light, in the same format.
    pub indirect: Image,
    /// `indirect` holds zeros: it need not be cleared again while there is no bounced light.
    pub indirect_is_black: bool,
    /// `Rgba16F`: radiance at the traced size before exposure; 1 is display white of the classic look. Written by
    /// `composite`, read by temporal antialiasing or the tone curve.
    pub composite: Image,
    /// `Rgba32F`: mean of the frames in reference mode; absent outside of it.
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
            scratch: texels(
                device,
                "trace scratch",
                [width, height].map(|n| n.next_multiple_of(RAY_TILE)),
                16,
            )?,
            position: make("trace position", Format::Rgba32F)?,
            surface: make("trace surface", Format::Rg32Uint)?,
            shown: make("trace shown", Format::Rg32Uint)?,
            other: make("trace other", Format::Rg32Uint)?,
            motion: make("trace motion", Format::Rgba16F)?,
            view_distance: [
                make("trace path", Format::R16F)?,
                make("trace last path", Format::R16F)?,
            ],
            direct: [
                make("trace direct", Format::R32Uint)?,
                make("trace last direct", Format::R32Uint)?,
            ],
            indirect: make("trace indirect", Format::R32Uint)?,
            indirect_is_black: false,
            composite: make("trace composite", Format::Rgba16F)?,
            accumulation: None,
        })
    }

    /// Makes or drops the image that only reference mode uses.
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

    /// The linear picture before temporal antialiasing.
    pub fn picture(&self) -> &Image {
        self.accumulation.as_ref().unwrap_or(&self.composite)
    }

    /// Ends the frame: its images become those of the last frame.
    pub fn advance(&mut self) {
        self.view_distance.swap(0, 1);
        self.direct.swap(0, 1);
    }
}
