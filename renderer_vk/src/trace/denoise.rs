//! The denoiser.
//!
//! `rt_denoiser 1` is A-SVGF (Schied, Peters, Dachsbacher, Gradient Estimation for Real-Time Adaptive Temporal
//! Filtering, 2018) over direct and indirect light:
//!
//! 1. [`Denoiser::reproject_gradients`], before lighting: selects in each stratum of 3 × 3 pixels one pixel that shades
//!    a surface of the last frame again, with that frame's random numbers.
//! 2. [`Denoiser::filter`], after lighting: spreads the change of light at those pixels over their neighbourhood;
//!    blends the light with the history, with less weight for history where light has changed; three wavelet steps,
//!    guided by the variance, remove the remaining noise. The result of the first step is the history of the next
//!    frame; the last step writes the filtered light into the image of direct light.
//!
//! `rt_denoiser 2` takes about 60 % of the time: a running mean over frames, which a change of the light shortens, and one
//! pass of few scattered taps.

use shaders::trace_types::DenoiseView;
use shaders::trace_types::constants as t;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use super::targets::{Targets, texels};
use crate::gpu::{Buffer, Device, Error, Format, Image, ImageDesc, ImageUsage};
use crate::settings::{DenoiserChoice, Settings};

/// Edge of a stratum, pixels; see `denoise.glsl`.
const STRATUM: u32 = 3;
/// Distances between the taps of the wavelet steps, pixels. A fourth step changed no measure of quality.
const WAVELET: [u32; 3] = [1, 3, 8];

/// The filter of frames with these settings. Reference pictures are not filtered.
pub fn in_use(settings: &Settings) -> DenoiserChoice {
    match settings.rt_accumulate {
        true => DenoiserChoice::None,
        false => settings.rt_denoiser,
    }
}

/// The filter in use.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tier {
    Adaptive,
    Sparse,
}

/// Filtered light of one eye, for the other.
#[derive(Clone, Copy, Debug)]
pub struct OtherEye {
    history: u64,
    size: [u32; 2],
    convergence: f32,
}

impl OtherEye {
    /// The light of an eye whose picture coincides with the other's at a distance, units.
    pub fn converging(self, convergence: f32) -> Self {
        Self {
            convergence,
            ..self
        }
    }
}

/// Images for one size of view: 25 bytes a pixel for the adaptive filter, 8 for the sparse one. Light is stored with
/// its guide, for the adaptive filter also with its variance.
struct Images {
    tier: Tier,
    size: [u32; 2],
    /// History of the last frame. After the temporal pass: the result of the first step, for the next frame.
    history: Buffer,
    adaptive: Option<AdaptiveImages>,
}

/// Further images of the adaptive filter.
struct AdaptiveImages {
    /// Number of frames and variance; before, bounced light. The history has those of the last frame.
    past: Image,
    /// For each stratum, light of one pixel of the last frame.
    samples: Image,
    sample_surfaces: Image,
    /// The gradient samples of this frame.
    gradient_pixels: Image,
    stratum_guide: Image,
    /// Their gradients, filtered.
    gradient: Image,
}

fn make(device: &Device, name: &str, size: [u32; 2], format: Format) -> Result<Image, Error> {
    let [width, height] = size;
    Image::new(
        device,
        &ImageDesc::new(name, width, height, format, ImageUsage::STORAGE),
    )
}

impl Images {
    fn new(device: &Device, tier: Tier, size: [u32; 2]) -> Result<Self, Error> {
        let bytes = match tier {
            Tier::Adaptive => 16,
            Tier::Sparse => 8,
        };
        Ok(Self {
            tier,
            size,
            history: texels(device, "trace light history", size, bytes)?,
            adaptive: match tier {
                Tier::Adaptive => Some(AdaptiveImages::new(device, size)?),
                Tier::Sparse => None,
            },
        })
    }
}

impl AdaptiveImages {
    fn new(device: &Device, size: [u32; 2]) -> Result<Self, Error> {
        let strata = size.map(|s| s.div_ceil(STRATUM));
        let strata = |name, format| make(device, name, strata, format);
        Ok(Self {
            past: make(device, "trace past", size, Format::R32Uint)?,
            samples: strata("trace samples", Format::Rgba32Uint)?,
            sample_surfaces: strata("trace sample surfaces", Format::Rgba32Uint)?,
            gradient_pixels: strata("trace gradient pixels", Format::R32Uint)?,
            stratum_guide: strata("trace stratum guide", Format::R32Uint)?,
            gradient: strata("trace gradient", Format::Rg16F)?,
        })
    }
}

/// The denoiser's images.
pub struct Denoiser {
    device: Device,
    images: Option<Images>,
    /// For each cell of 2 × 2 pixels, whether it gathers bounced light; only where not all do.
    selected: Option<Image>,
    /// Placeholder for absent images: software drivers access the images of branches that are not taken.
    nothing: Image,
    /// The images hold valid light of the last frame.
    history: bool,
    /// Off: history keeps its weight even if the light changes, as in SVGF. For comparisons.
    pub gradients: bool,
    /// This frame's light can be repeated from its random numbers, and the settings want gradients.
    repeats: bool,
}

impl Denoiser {
    /// A denoiser without images; [`prepare`](Self::prepare) makes them.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device) -> Result<Self, Error> {
        Ok(Self {
            device: device.clone(),
            images: None,
            selected: None,
            nothing: make(device, "trace no light", [1, 1], Format::Rgba32Uint)?,
            history: false,
            gradients: true,
            repeats: true,
        })
    }

    /// Call before the parameters of a frame are collected. `size`: of the view, pixels; `goes_on`: the frame continues
    /// the last drawn one, whose motion and camera are known; `gradients`: it has gradient samples.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        mode: DenoiserChoice,
        size: [u32; 2],
        goes_on: bool,
        gradients: bool,
    ) -> Result<(), Error> {
        self.repeats = gradients;
        let tier = match mode {
            DenoiserChoice::None => None,
            DenoiserChoice::ASvgf => Some(Tier::Adaptive),
            DenoiserChoice::Sparse => Some(Tier::Sparse),
        };
        let had = self.images.as_ref().map(|i| (i.tier, i.size));
        if had != tier.map(|tier| (tier, size)) {
            // free the old images first: memory may not suffice for both
            self.images = None;
            self.history = false;
            if let Some(tier) = tier {
                self.images = Some(Images::new(&self.device, tier, size)?);
            }
        }
        self.history &= goes_on;
        Ok(())
    }

    /// Makes or drops the image of the cells that gather bounced light.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare_cells(&mut self, adaptive: bool, size: [u32; 2]) -> Result<(), Error> {
        let cells = size.map(|n| n.div_ceil(2));
        let fits = |image: &Image| adaptive && [image.width(), image.height()] == cells;
        self.selected = self.selected.take().filter(fits);
        if adaptive && self.selected.is_none() {
            let made = make(&self.device, "trace selected cells", cells, Format::R32Uint)?;
            self.selected = Some(made);
        }
        Ok(())
    }

    /// Whether this frame is filtered.
    pub fn is_on(&self) -> bool {
        self.images.is_some()
    }

    /// The image of this frame's bounced light with the adaptive filter: the filter overwrites it once it has read it.
    pub fn indirect(&self) -> Option<&Image> {
        let images = self.images.as_ref()?;
        images.adaptive.as_ref().map(|adaptive| &adaptive.past)
    }

    /// The light of the last frame with the adaptive filter, for the other eye.
    pub fn light(&self) -> Option<OtherEye> {
        let images = self.images.as_ref().filter(|_| self.history)?;
        images.adaptive.as_ref().map(|_| OtherEye {
            history: images.history.address(),
            size: images.size,
            convergence: 0.0,
        })
    }

    /// The images, if this frame has gradient samples.
    fn gradient_images(&self) -> Option<&Images> {
        let wanted = self.history && self.gradients && self.repeats;
        self.images
            .as_ref()
            .filter(|i| wanted && i.tier == Tier::Adaptive)
    }

    /// Parameters of the passes. `last_seed`: random seed of the last frame; `targets`: images of the view, whose
    /// scratch memory holds gradients, then light that is being filtered; `other`: light of the other eye.
    pub fn view(&self, last_seed: u32, targets: &Targets, other: Option<&OtherEye>) -> DenoiseView {
        let nothing = self.nothing.storage_index();
        let empty = DenoiseView {
            flags: 0,
            last_seed,
            samples: nothing,
            sample_surfaces: nothing,
            gradient_pixels: nothing,
            stratum_guide: nothing,
            gradient: nothing,
            past: nothing,
            selected: (self.selected.as_ref()).map_or(nothing, Image::storage_index),
            depth_gradient: targets.depth_gradient[0].storage_index(),
            ..DenoiseView::default()
        };
        let Some(images) = &self.images else {
            return empty;
        };
        let flag = |on: bool, bit: u32| if on { bit } else { 0 };
        let view = DenoiseView {
            flags: flag(self.history, t::DENOISE_HISTORY)
                | flag(self.gradient_images().is_some(), t::DENOISE_GRADIENTS)
                | flag(images.tier == Tier::Sparse, t::DENOISE_SPARSE),
            history: images.history.address(),
            fresh: targets.scratch.address(),
            ..empty
        };
        let Some(adaptive) = &images.adaptive else {
            return view;
        };
        let strata = images.size.map(|s| u64::from(s.div_ceil(STRATUM)));
        let strata = strata[0] * strata[1];
        let other = other.filter(|other| other.size == images.size);
        DenoiseView {
            other_eye: other.map_or(0, |other| other.history),
            convergence: other.map_or(0.0, |other| other.convergence),
            samples: adaptive.samples.storage_index(),
            sample_surfaces: adaptive.sample_surfaces.storage_index(),
            gradient_pixels: adaptive.gradient_pixels.storage_index(),
            stratum_guide: adaptive.stratum_guide.storage_index(),
            gradient_samples: targets.scratch.address(),
            gradient_sums: targets.scratch.address() + 16 * strata,
            gradient: adaptive.gradient.storage_index(),
            past: adaptive.past.storage_index(),
            ..view
        }
    }

    /// Selects the gradient samples of a frame, before lighting.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn reproject_gradients(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        match self.gradient_images() {
            Some(_) => passes.run(Pass::GradientReproject),
            None => Ok(()),
        }
    }

    /// Filters the traced light together with the history; writes the sum of direct and indirect light into the image
    /// of direct light. `fresh`: the scratch memory given to [`view`](Self::view).
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn filter(&self, passes: &mut FramePasses<'_>, fresh: &Buffer) -> Result<(), Error> {
        let Some(images) = &self.images else {
            return Ok(());
        };
        if self.gradient_images().is_some() {
            passes.run(Pass::GradientSample)?;
            passes.run(Pass::Gradient)?;
            passes.run(Pass::GradientWide)?;
        }
        if images.tier == Tier::Sparse {
            passes.run(Pass::SparseTemporal)?;
            return passes.run(Pass::SparseFilter);
        }
        passes.run(Pass::Temporal)?;
        let [history, fresh] = [&images.history, fresh].map(Buffer::address);
        // The first step overwrites the history, which the temporal pass has merged into the fresh light; the last step
        // writes an image.
        let [first, second, last] = WAVELET;
        passes.run_step(Pass::WaveletFirst, fresh, history, first)?;
        passes.run_step(Pass::WaveletSecond, history, fresh, second)?;
        passes.run_step(Pass::WaveletLast, fresh, fresh, last)
    }

    /// Ends the frame: its images become those of the last frame.
    pub fn advance(&mut self) {
        self.history = self.images.is_some();
    }
}
