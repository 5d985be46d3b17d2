//! Resolves the traced picture to the window's size: temporal antialiasing, and upscaling with and without it.
//!
//! With temporal antialiasing, each frame's rays are jittered within their pixels by the R2 sequence (Roberts, The
//! Unreasonable Effectiveness of Quasirandom Sequences, 2018: every run of its samples is evenly distributed), and a
//! picture of the output's size is accumulated over frames.

use glam::Vec2;
use shaders::trace_types::AntialiasView;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use super::targets::Targets;
use crate::gpu::{
    Device, Error, Filter, Format, Image, ImageDesc, ImageUsage, MipFilter, SamplerDesc, Wrap,
};
use crate::settings::Settings;

/// Least traced size along each axis, as a part of the output's.
const LEAST_SCALE: f32 = 0.25;

/// Method that makes a view's picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// The traced picture is shown unchanged.
    Plain,
    /// Temporal antialiasing, with upscaling.
    Temporal,
    /// Upscaling of a single frame.
    Upscale,
}

impl Method {
    fn of(settings: &Settings, output: [u32; 2]) -> Self {
        if settings.rt_accumulate {
            Self::Plain
        } else if is_temporal(settings) {
            Self::Temporal
        } else if traced_size(settings, output) != output {
            Self::Upscale
        } else {
            Self::Plain
        }
    }
}

/// Whether frames with these settings are antialiased over time. Multisampling is replaced by one jittered sample per
/// frame.
pub fn is_temporal(settings: &Settings) -> bool {
    !settings.rt_accumulate && (settings.rt_taa || settings.multisample > 1)
}

/// Whether frames with these settings keep the maximum of the colour range.
pub fn smooths_maximum(settings: &Settings) -> bool {
    is_temporal(settings) && settings.rt_taa_maximum > 0.0
}

/// Whether pixels without history are sampled again with these settings (`rt_taaRays`). Not with a lens, through which a
/// pixel shows several surfaces.
pub fn traces_more(settings: &Settings) -> bool {
    is_temporal(settings) && settings.rt_taa_rays > 0 && !settings.rt_dof
}

/// Traced size for a picture of the size `output`, pixels. Reference pictures are traced in full size.
pub fn traced_size(settings: &Settings, output: [u32; 2]) -> [u32; 2] {
    if settings.rt_accumulate || settings.rt_scale.is_nan() || settings.rt_scale >= 1.0 {
        return output;
    }
    let scale = settings.rt_scale.max(LEAST_SCALE);
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss
    )] // a number of pixels
    output.map(|side| ((side as f32 * scale).round() as u32).clamp(1, side.max(1)))
}

/// A resolved picture.
struct Resolved {
    /// `Rgba16F`: radiance, and the number of frames in it.
    picture: Image,
    /// `Rg32Uint`, the same texels: `Targets::other`, until the picture is resolved.
    other: Image,
}

impl Resolved {
    fn new(device: &Device, name: &str, [width, height]: [u32; 2]) -> Result<Self, Error> {
        let usage = ImageUsage::STORAGE | ImageUsage::SAMPLED;
        let desc = ImageDesc {
            other_format: Some(Format::Rg32Uint),
            ..ImageDesc::new(name, width, height, Format::Rgba16F, usage)
        };
        let picture = Image::new(device, &desc)?;
        Ok(Self {
            other: picture.in_other_format()?,
            picture,
        })
    }
}

/// Whether frames with these settings are resolved to images of their own, [`Antialias::other`] among them.
pub fn resolves(settings: &Settings, output: [u32; 2]) -> bool {
    Method::of(settings, output) != Method::Plain
}

/// Resolves traced pictures to the window's size.
pub struct Antialias {
    sampler: u32,
    /// Resolved pictures of this frame and the last, while the traced picture is not shown unchanged.
    resolved: Option<[Resolved; 2]>,
    /// Greatest luminance of the colour range in this frame and the last, `R16F`, while it is smoothed.
    maxima: Option<[Image; 2]>,
    /// `Rgba16F` of the traced size: more samples of pixels without history, while they are traced.
    pub(super) more_samples: Option<Image>,
    /// The last frame left a valid resolved picture, and the maxima if there are any.
    history: bool,
    frame: u32,
    method: Method,
    /// The resolved picture is sharpened, into the image of the last frame's, which nothing reads any more.
    sharpens: bool,
}

impl Antialias {
    /// Without a history.
    ///
    /// # Errors
    /// The device has no room for the sampler.
    pub fn new(device: &Device) -> Result<Self, Error> {
        Ok(Self {
            sampler: device.sampler(&SamplerDesc {
                filter: Filter::Linear,
                mip: MipFilter::None,
                wrap: Wrap::Clamp,
                anisotropy: 1.0,
                lod_bias: 0.0,
            })?,
            resolved: None,
            maxima: None,
            more_samples: None,
            history: false,
            frame: 0,
            method: Method::Plain,
            sharpens: false,
        })
    }

    /// Discards the history. The jitter sequence restarts, too, so that equal frames give equal pictures.
    #[cfg(test)]
    pub fn reset(&mut self) {
        self.history = false;
        self.frame = 0;
    }

    /// Prepares a view of the size `output`. `targets`: the images that it is traced to; `history`: the last frame
    /// showed the same scene.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        device: &Device,
        settings: &Settings,
        output: [u32; 2],
        targets: &Targets,
        history: bool,
    ) -> Result<AntialiasView, Error> {
        let method = Method::of(settings, output);
        if method == Method::Plain {
            self.resolved = None;
        } else if self
            .resolved
            .as_ref()
            .is_none_or(|[r, _]| [r.picture.width(), r.picture.height()] != output)
        {
            // free the old images first: memory may not suffice for both
            self.resolved = None;
            self.resolved = Some([
                Resolved::new(device, "trace resolved", output)?,
                Resolved::new(device, "trace last resolved", output)?,
            ]);
            self.history = false;
        }
        self.fit_maxima(device, smooths_maximum(settings), output)?;
        let traced = [targets.width, targets.height];
        self.fit_more_samples(device, traces_more(settings), traced)?;
        self.history &= history && method == self.method;
        self.method = method;
        let jittered = method == Method::Temporal && settings.rt_antialiasing;
        let dof = settings.rt_dof && settings.rt_aperture > 0.0;
        self.sharpens = self.resolved.is_some() && settings.rt_sharpness > 0.0;
        let (image, last) = match &self.resolved {
            Some([now, last]) => (now.picture.storage_index(), last.picture.texture_index()),
            None => (0, 0),
        };
        let picture = match &self.resolved {
            Some([_, last]) if self.sharpens => &last.picture,
            Some([now, _]) => &now.picture,
            None => targets.picture(),
        };
        let [maximum, last_maximum] =
            (self.maxima.as_ref()).map_or([0; 2], |m| [&m[0], &m[1]].map(Image::storage_index));
        Ok(AntialiasView {
            jitter: if jittered {
                jitter(self.frame)
            } else {
                Vec2::ZERO
            },
            output_width: output[0],
            output_height: output[1],
            image_picture: picture.storage_index(),
            image_resolved: image,
            last_resolved: last,
            last_light: targets.direct[1].storage_index(),
            sampler_index: self.sampler,
            history: u32::from(self.history),
            lens_radius: if dof { 0.5 * settings.rt_aperture } else { 0.0 },
            focal_distance: settings.rt_focal_length.max(1.0),
            texture_scale: texture_scale(settings, output, jittered),
            anisotropy: settings.anisotropy(),
            sharpness: settings.rt_sharpness,
            maximum,
            last_maximum,
            maximum_kept: settings.rt_taa_maximum,
            more_samples: (self.more_samples.as_ref()).map_or(0, Image::storage_index),
            more_rays: settings.rt_taa_rays,
            padding: 0,
        })
    }

    /// Makes or drops the images of the maxima.
    fn fit_maxima(&mut self, device: &Device, needed: bool, size: [u32; 2]) -> Result<(), Error> {
        let [width, height] = size;
        (self.maxima).take_if(|[m, _]| !needed || [m.width(), m.height()] != size);
        if needed && self.maxima.is_none() {
            let make = |name| {
                let desc = ImageDesc::new(name, width, height, Format::R16F, ImageUsage::STORAGE);
                Image::new(device, &desc)
            };
            self.maxima = Some([make("trace maximum")?, make("trace last maximum")?]);
            self.history = false;
        }
        Ok(())
    }

    /// Makes or drops the image of more samples.
    fn fit_more_samples(
        &mut self,
        device: &Device,
        needed: bool,
        [width, height]: [u32; 2],
    ) -> Result<(), Error> {
        (self.more_samples).take_if(|m| !needed || [m.width(), m.height()] != [width, height]);
        if needed && self.more_samples.is_none() {
            let (name, format) = ("trace more samples", Format::Rgba16F);
            let desc = ImageDesc::new(name, width, height, format, ImageUsage::STORAGE);
            self.more_samples = Some(Image::new(device, &desc)?);
        }
        Ok(())
    }

    /// An image as `Targets::other`, which nothing else uses before the picture is resolved; `None` if the traced
    /// picture is shown unchanged.
    pub fn other(&self) -> Option<&Image> {
        self.resolved.as_ref().map(|[now, _]| &now.other)
    }

    /// Records the passes of the method.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses the pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        match self.method {
            Method::Plain => return Ok(()),
            Method::Temporal => {
                if self.more_samples.is_some() {
                    passes.run(Pass::MoreSamples)?;
                }
                passes.run(Pass::Antialias)?;
            }
            Method::Upscale => passes.run(Pass::Upscale)?,
        }
        if self.sharpens {
            passes.run(Pass::Sharpen)?;
        }
        Ok(())
    }

    /// Ends the frame: its resolved picture becomes that of the last frame.
    pub fn advance(&mut self) {
        if let Some(resolved) = &mut self.resolved {
            resolved.swap(0, 1);
        }
        if let Some(maxima) = &mut self.maxima {
            maxima.swap(0, 1);
        }
        self.history = self.method == Method::Temporal;
        self.frame = self.frame.wrapping_add(1);
    }

    /// The picture of the last frame, if it was resolved: after [`advance`](Self::advance), which swaps the images.
    pub fn picture(&self) -> Option<&Image> {
        let [sharpened, resolved] = self.resolved.as_ref()?;
        let shown = if self.sharpens { sharpened } else { resolved };
        Some(&shown.picture)
    }
}

/// Scale of texture gradients. With temporal antialiasing, textures are sampled at the resolution of the output's
/// pixels and half a mip level finer, which the mean over frames smooths.
fn texture_scale(settings: &Settings, output: [u32; 2], jittered: bool) -> f32 {
    if !jittered {
        return 1.0;
    }
    #[allow(clippy::cast_precision_loss)] // a number of pixels
    let ratio = traced_size(settings, output)[1] as f32 / output[1].max(1) as f32;
    ratio * std::f32::consts::FRAC_1_SQRT_2
}

/// Offset of a frame's rays from the pixel centre: the R2 sequence in fixed point, exact for any number of frames.
fn jitter(frame: u32) -> Vec2 {
    // 2^32 divided by the plastic number, and by its square
    let step = [3_242_174_889u32, 2_447_445_414];
    #[allow(clippy::cast_precision_loss)] // 24 bits are kept
    let part =
        |step: u32| (frame.wrapping_add(1).wrapping_mul(step) >> 8) as f32 / (1 << 24) as f32 - 0.5;
    Vec2::new(part(step[0]), part(step[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_covers_the_pixel_evenly() {
        for frames in [16u32, 64, 100] {
            let mean: Vec2 = (0..frames).map(jitter).sum::<Vec2>() / frames as f32;
            assert!(mean.length() < 2.0 / frames as f32, "{frames}: {mean}");
        }
        // any 40 consecutive frames have a sample in each sixteenth of the pixel
        for begin in [0u32, 1000, u32::MAX - 10] {
            let mut hit = [false; 16];
            for i in 0..40 {
                let at = ((jitter(begin.wrapping_add(i)) + 0.5) * 4.0).floor();
                assert!((0.0..4.0).contains(&at.x) && (0.0..4.0).contains(&at.y));
                hit[at.x as usize + 4 * at.y as usize] = true;
            }
            assert!(hit.iter().all(|h| *h), "{begin}: {hit:?}");
        }
    }

    #[test]
    fn traced_sizes() {
        let size = |scale, accumulate| {
            let settings = Settings {
                rt_scale: scale,
                rt_accumulate: accumulate,
                ..Settings::default()
            };
            traced_size(&settings, [641, 3])
        };
        assert_eq!(size(1.0, false), [641, 3]);
        assert_eq!(size(0.5, false), [321, 2]);
        assert_eq!(size(0.5, true), [641, 3]);
        assert_eq!(size(0.0, false), [160, 1]);
        assert_eq!(size(f32::NAN, false), [641, 3]);
    }
}
