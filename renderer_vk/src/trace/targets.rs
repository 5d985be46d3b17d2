//! The images of the traced look.

use shaders::trace_types::constants::RAY_TILE;

use crate::gpu::{
    Buffer, BufferDesc, BufferUsage, Device, Error, Format, Image, ImageDesc, ImageUsage, Memory,
};

/// Texels of a size in pixels, `bytes` each.
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

/// Images of one size: the G-buffer, the light, the picture before tone mapping, and the accumulated sum.
///
/// Formats are given as texels are read; colours are linear, lengths units of the map. *Light* is four bytes: three
/// mantissas of nine bits with one exponent (`light_image.glsl`).
pub struct Targets {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 16 bytes a pixel that passes use in turns: primary hits, then sampled lights, then light that the denoiser filters.
    pub scratch: Buffer,
    /// `Rgba32F`: world position of the surface that is shown, and length of the way to it from the eye (negative: nothing
    /// to light; its lowest bit is set of what the eye alone sees). Written by `plain` and `primary`, read by all that light
    /// or filter.
    pub position: Image,
    /// `Rg32Uint`: normal of its triangle and normal that it is lit by, packed (`direction.glsl`). Written and read as
    /// `position` is.
    pub surface: Image,
    /// `Rg32Uint`, two of light: albedo, with all that lies between the eye and the surface, and the radiance of what is in
    /// front of the surface and of its own glow. Written by `plain` and `primary`, read by `composite`.
    pub shown: Image,
    /// Where pixels show what a surface reflects and what lies behind it in turns: as `shown`, of that which the pixel
    /// does not show. Written by the pass of the other side.
    pub other: Image,
    /// `Rgba16F`: how far from the pixel its surface was in the last frame (pixels, right and down), the length of the way
    /// to it then (negative: unknown), and the mark of the pixel (`motion.glsl`). Read by the denoiser and by TAA.
    pub motion: Image,
    /// `R16F`: view distance in this frame and in the last; negative where the surface moves in the picture.
    pub view_distance: [Image; 2],
    /// `R32Uint`, light: what comes straight from lamps and suns, without albedo. Written by `direct` and `suns`, where the
    /// denoiser leaves the filtered light for `composite`; of this frame and the last.
    pub direct: [Image; 2],
    /// Bounced light, likewise.
    pub indirect: Image,
    /// `indirect` holds zeros: nothing has to be written while nothing bounces.
    pub indirect_is_black: bool,
    /// `Rgba16F`: radiance of the traced size before exposure; 1 is display white of the classic look. Written by
    /// `composite`, read by TAA or the tone curve.
    pub composite: Image,
    /// `Rgba32F`: the mean of the frames in reference mode, while that is on.
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

    /// What this frame has written becomes what the last one wrote.
    pub fn advance(&mut self) {
        self.view_distance.swap(0, 1);
        self.direct.swap(0, 1);
    }
}
