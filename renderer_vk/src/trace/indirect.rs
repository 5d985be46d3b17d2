//! Bounced light: which passes gather it.

use super::denoise;
use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::Error;
use crate::settings::{DenoiserChoice, Settings};

/// Whether one of 2 × 2 pixels gathers bounced light: in a denoised picture the difference is invisible, and gathering
/// is the most expensive pass. In reference mode and in undenoised pictures every pixel gathers.
pub fn is_subsampled(settings: &Settings) -> bool {
    denoise::in_use(settings) != DenoiserChoice::None && settings.rt_bounces > 0
}

/// Whether the rays, the surfaces that they meet, and the light there have a pass each, and not one in common.
pub fn is_split(settings: &Settings) -> bool {
    is_subsampled(settings) && settings.rt_bounces == 1
}

/// Records the passes that gather bounced light.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record(passes: &mut FramePasses<'_>, settings: &Settings) -> Result<(), Error> {
    if is_split(settings) {
        passes.run(Pass::BounceRays)?;
        passes.run(Pass::BounceShade)?;
        passes.run(Pass::BounceLight)?;
    } else {
        passes.run(Pass::Indirect)?;
    }
    if passes.facts.subsampled {
        passes.run(Pass::BounceUpsample)?;
    }
    Ok(())
}
