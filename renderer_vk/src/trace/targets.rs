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

/// A storage image of a size in pixels.
fn storage(name: &str, [width, height]: [u32; 2], format: Format) -> ImageDesc<'_> {
    ImageDesc::new(name, width, height, format, ImageUsage::STORAGE)
}

/// Images that only some settings need, with memory of their own.
#[derive(Clone, Copy, Debug)]
pub struct OwnImages {
    /// `Targets::accumulation`.
    pub accumulation: bool,
    /// `Targets::other`.
    pub other: bool,
    /// `Targets::indirect`.
    pub indirect: bool,
    /// `Targets::specular` and `Targets::specular_light`.
    pub specular: bool,
    /// `Targets::specular_history`.
    pub specular_history: bool,
    /// `Targets::composite`; otherwise it is in the memory of `surface`.
    pub composite: bool,
    /// `Targets::fog`; otherwise it is in the memory of `position`.
    pub fog: bool,
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
    /// `Rg32Uint`: world position of the shown surface, relative to the ray through the pixel (`gbuffer.glsl`). Written
    /// by `primary_simple` and `primary`, read by all passes that light, and last by the first pass of the denoiser.
    pub position: Image,
    /// `Rgba16F`: filtered light in fog, in the memory of `position` unless a debug output shows positions afterwards.
    /// The cells of the light are fewer than the pixels and fill a corner.
    pub fog: Image,
    /// `Rg32Uint`: geometric normal and shading normal, packed (`direction.glsl`). Written as `position` is, and read
    /// until the denoiser has joined the light with its history; `composite` then overwrites it.
    pub surface: Image,
    /// `Rg32Uint`, two of light: albedo times the transmission between camera and surface, and the radiance in front of
    /// the surface plus its own emission. Written by `primary_simple` and `primary`, read by `composite`.
    pub shown: Image,
    /// As `shown`, for pixels that show reflection and refraction alternately: the side that the pixel does not show.
    /// Written by `trace_other_side`, read by `composite`. Absent in reference mode, and where the image that
    /// [`Antialias`](super::antialias::Antialias) writes afterwards serves.
    pub other: Option<Image>,
    /// `Rgba16F`: offset of the surface's pixel in the last frame (pixels, right and down), its view distance in that
    /// frame (negative: unknown), and the pixel's mark (`motion.glsl`). Read by the denoiser and by temporal
    /// antialiasing.
    pub motion: Image,
    /// `R16F`: view distance in this frame and in the last; negative where the surface moves in the picture.
    pub view_distance: [Image; 2],
    /// `R16Uint`: what half floats lack of this frame's view distance; whether the pixel shows a surface to light, and
    /// one that only camera rays see (`view_distance.glsl`).
    pub distance_tail: Image,
    /// `R32Uint`, light: direct light of lamps and suns, without albedo; of this frame and the last. Written by
    /// `direct` and `suns`; the denoiser replaces it with the filtered light for `composite`.
    pub direct: [Image; 2],
    /// `Rg16F`, in the memory of `direct`: change of depth to the next pixel, which guides the denoiser from its first
    /// pass, which has read the direct light, to its last, which writes the filtered light.
    pub depth_gradient: [Image; 2],
    /// Bounced light, in the same format. Absent where an image of the [`Denoiser`](super::denoise::Denoiser) serves.
    pub indirect: Option<Image>,
    /// `Rgba32Uint`: specular reflection of the surface (`specular_surface.glsl`). Written by `primary_simple` and
    /// `primary`, read by `specular_light`, `bounce_rays` and `composite`. Absent without rough surfaces.
    pub specular: Option<Image>,
    /// `R32Uint`, light: specular light before the reflectance. Absent without rough surfaces.
    pub specular_light: Option<Image>,
    /// `Rg32Uint`: specular light joined with that of earlier frames (`specular_filter.glsl`), of this frame and the last.
    /// Absent where no filter runs.
    pub specular_history: Option<[Image; 2]>,
    /// The last frame has written its image of them.
    pub has_specular_history: bool,
    /// `indirect` holds zeros: it need not be cleared again while there is no bounced light.
    pub indirect_is_black: bool,
    /// `Rgba16F`: radiance at the traced size before exposure; 1 is display white of the classic look. Written by
    /// `composite`, read by temporal antialiasing or the tone curve. In the memory of `surface`, unless a debug output
    /// shows the normals after it was written.
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
        let size = [width, height];
        let make = |name, format| Image::new(device, &storage(name, size, format));
        let shared = |name, format, other_format| {
            let desc = ImageDesc {
                other_format: Some(other_format),
                ..storage(name, size, format)
            };
            let image = Image::new(device, &desc)?;
            Ok((image.clone(), image.in_other_format()?))
        };
        let (position, fog) = shared("trace position", Format::Rg32Uint, Format::Rgba16F)?;
        let (surface, composite) = shared("trace surface", Format::Rg32Uint, Format::Rgba16F)?;
        let (direct, depth_gradient) = shared("trace direct", Format::R32Uint, Format::Rg16F)?;
        let (last_direct, last_depth_gradient) =
            shared("trace last direct", Format::R32Uint, Format::Rg16F)?;
        Ok(Self {
            width,
            height,
            scratch: texels(
                device,
                "trace scratch",
                size.map(|n| n.next_multiple_of(RAY_TILE)),
                16,
            )?,
            position,
            fog,
            surface,
            shown: make("trace shown", Format::Rg32Uint)?,
            other: None,
            motion: make("trace motion", Format::Rgba16F)?,
            view_distance: [
                make("trace path", Format::R16F)?,
                make("trace last path", Format::R16F)?,
            ],
            distance_tail: make("trace path tail", Format::R16Uint)?,
            direct: [direct, last_direct],
            depth_gradient: [depth_gradient, last_depth_gradient],
            indirect: None,
            specular: None,
            specular_light: None,
            specular_history: None,
            has_specular_history: false,
            indirect_is_black: false,
            composite,
            accumulation: None,
        })
    }

    /// Makes or drops the images that only some settings need.
    ///
    /// # Errors
    /// Out of memory.
    pub fn fit(&mut self, device: &Device, own: OwnImages) -> Result<(), Error> {
        let size = [self.width, self.height];
        let make = |name, format| Image::new(device, &storage(name, size, format));
        let fit = |image: &mut Option<Image>, needed: bool, name, format| {
            if !needed {
                *image = None;
            } else if image.is_none() {
                *image = Some(make(name, format)?);
            }
            Ok::<(), Error>(())
        };
        let wide = Format::Rgba32F;
        fit(
            &mut self.accumulation,
            own.accumulation,
            "trace accumulation",
            wide,
        )?;
        fit(&mut self.other, own.other, "trace other", Format::Rg32Uint)?;
        self.indirect_is_black &= self.indirect.is_some();
        fit(
            &mut self.indirect,
            own.indirect,
            "trace indirect",
            Format::R32Uint,
        )?;
        let wide = Format::Rgba32Uint;
        fit(&mut self.specular, own.specular, "trace specular", wide)?;
        fit(
            &mut self.specular_light,
            own.specular,
            "trace specular light",
            Format::R32Uint,
        )?;
        if !own.specular_history {
            self.specular_history = None;
            self.has_specular_history = false;
        } else if self.specular_history.is_none() {
            self.specular_history = Some([
                make("trace specular history", Format::Rg32Uint)?,
                make("trace last specular history", Format::Rg32Uint)?,
            ]);
        }
        let share = |image: &mut Image, owner: &Image, apart: bool, name| {
            let shares = image.owner().storage_index() == owner.storage_index();
            if shares == apart {
                *image = match apart {
                    true => make(name, Format::Rgba16F)?,
                    false => owner.in_other_format()?,
                };
            }
            Ok::<(), Error>(())
        };
        share(
            &mut self.composite,
            &self.surface,
            own.composite,
            "trace composite",
        )?;
        share(&mut self.fog, &self.position, own.fog, "trace fog filtered")
    }

    /// The linear picture before temporal antialiasing.
    pub fn picture(&self) -> &Image {
        self.accumulation.as_ref().unwrap_or(&self.composite)
    }

    /// Ends the frame: its images become those of the last frame.
    pub fn advance(&mut self) {
        self.view_distance.swap(0, 1);
        self.direct.swap(0, 1);
        self.depth_gradient.swap(0, 1);
        if let Some(history) = &mut self.specular_history {
            history.swap(0, 1);
            self.has_specular_history = true;
        }
    }
}
