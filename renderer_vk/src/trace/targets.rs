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
pub struct Targets {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 16 bytes a pixel that passes hand on: what the eye's rays meet, until the G-buffer is written; the light that is
    /// chosen, until a ray is sent to it; then the light that the denoiser is filtering.
    pub texels: Buffer,
    /// World position and length of the way from the eye.
    pub position: Image,
    /// Packed normals.
    pub surface: Image,
    /// Albedo, with all that lies between the eye and the surface, and the radiance of what is in front of the surface and
    /// of its own glow; packed as in `light_image.glsl`.
    pub shown: Image,
    /// Where pixels show what a surface reflects and what lies behind it in turns: as `shown`, of that which the pixel
    /// does not show.
    pub other: Image,
    /// Where the surface was in the last frame and how far away, see [`super::motion`], and the mark of the pixel.
    pub motion: Image,
    /// How far away it is; of this frame and the last.
    pub path: [Image; 2],
    /// Direct light as it comes from the rays, packed as in `light_image.glsl`.
    pub direct: Image,
    /// Bounced light, likewise.
    pub indirect: Image,
    /// `indirect` holds zeros: nothing has to be written while nothing bounces.
    pub indirect_is_black: bool,
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
            texels: texels(
                device,
                "trace texels",
                [width, height].map(|n| n.next_multiple_of(RAY_TILE)),
                16,
            )?,
            position: make("trace position", Format::Rgba32F)?,
            surface: make("trace surface", Format::Rg32Uint)?,
            shown: make("trace shown", Format::Rg32Uint)?,
            other: make("trace other", Format::Rg32Uint)?,
            motion: make("trace motion", Format::Rgba16F)?,
            path: [
                make("trace path", Format::R16F)?,
                make("trace last path", Format::R16F)?,
            ],
            direct: make("trace direct", Format::R32Uint)?,
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
        self.path.swap(0, 1);
    }
}
