//! Bounced light: which passes gather it.

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::Error;
use crate::settings::{DenoiserChoice, Settings};

/// Whether one of 2 × 2 pixels gathers bounced light: in a denoised picture the difference is invisible, and gathering
/// is the most expensive pass. In reference mode and in undenoised pictures every pixel gathers.
pub fn is_subsampled(settings: &Settings) -> bool {
    !settings.rt_accumulate
        && settings.rt_denoiser != DenoiserChoice::None
        && settings.rt_bounces > 0
}

/// Records the passes that gather bounced light.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record(passes: &mut FramePasses<'_>, settings: &Settings) -> Result<(), Error> {
    let subsampled = passes.facts.subsampled;
    if subsampled && settings.rt_bounces == 1 {
        passes.run(Pass::BounceRays)?;
        passes.run(Pass::BounceShade)?;
        passes.run(Pass::BounceLight)?;
    } else {
        passes.run(Pass::Indirect)?;
    }
    if subsampled {
        passes.run(Pass::BounceUpsample)?;
    }
    Ok(())
}
