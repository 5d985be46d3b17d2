//! Bounced light: which passes gather it.

use super::pass_set::PassSet;
use crate::gpu::{Error, Recorder};
use crate::settings::Settings;

/// Whether bounced light is gathered for a quarter of the pixels: in a picture that is denoised nobody can tell, and it is the
/// dearest pass. Reference mode and undenoised pictures get every pixel.
pub fn is_subsampled(settings: &Settings) -> bool {
    !settings.rt_accumulate && settings.rt_denoiser > 0 && settings.rt_bounces > 0
}

/// Records the passes that write `indirect`. `view`: device address of the `TraceView`; `size`: its pixels.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record(
    passes: &PassSet,
    rec: &mut Recorder,
    view: u64,
    size: [u32; 2],
    settings: &Settings,
    has_fog: bool,
) -> Result<(), Error> {
    let cells = size.map(|n| n.div_ceil(2));
    let sparse = is_subsampled(settings);
    let fog = usize::from(has_fog);
    if sparse && settings.rt_bounces == 1 {
        let meets = passes.get(&passes.bounce_shade[fog])?;
        passes.get(&passes.bounce_rays)?.record(rec, view, cells)?;
        meets.record(rec, view, cells)?;
        passes
            .get(&passes.bounce_lights)?
            .record(rec, view, cells)?;
    } else {
        let paths = passes.get(&passes.indirect[fog])?;
        paths.record(rec, view, if sparse { cells } else { size })?;
    }
    if sparse {
        passes.get(&passes.fill)?.record(rec, view, cells)?;
    }
    Ok(())
}
