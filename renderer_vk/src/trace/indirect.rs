//! Bounced light: which passes gather it.

use shaders::trace_types::TransportView;
use shaders::trace_types::constants as t;

use super::denoise;
use super::frame_passes::FramePasses;
use super::passes::{Pass, Resource};
use super::targets::Targets;
use crate::gpu::{Access, Error};
use crate::settings::{DenoiserChoice, MOST_BOUNCES, Settings};

// No stream of random numbers is used twice: those of three passes of each bounce, then those of light across mirrors, then
// those of the pixel's next path.
const _: () = {
    assert!(t::STREAM_MIRRORS >= t::STREAM_BOUNCE + t::STREAMS * 3 * MOST_BOUNCES);
    assert!((t::STREAM_MIRRORS - t::STREAM_BOUNCE).is_multiple_of(t::STREAMS));
    assert!(t::STREAM_SPECULAR >= t::STREAM_MIRRORS + t::STREAMS * (MOST_BOUNCES + 1));
    assert!(t::STREAM_PATH > t::STREAM_SPECULAR);
};

/// Whether one of 2 × 2 pixels gathers bounced and specular light: in a denoised picture the difference is invisible, and
/// gathering is the most expensive pass. In reference mode and in undenoised pictures every pixel gathers. `gloss`:
/// there are rough surfaces.
pub fn is_subsampled(settings: &Settings, gloss: bool) -> bool {
    denoise::in_use(settings) != DenoiserChoice::None && (settings.rt_bounces > 0 || gloss)
}

/// Whether only those cells of 2 × 2 pixels gather bounced light whose history needs it. The adaptive denoiser holds the
/// number of its samples, and the changes of the light.
pub fn is_adaptive(settings: &Settings) -> bool {
    settings.rt_bounce_adaptive > 0
        && settings.rt_bounces > 0
        && denoise::in_use(settings) == DenoiserChoice::ASvgf
}

/// Whether the last bounce adds light of further ones (`rt_bounceAmbient`).
pub fn adds_ambient(settings: &Settings) -> bool {
    settings.rt_bounce_ambient > 0.0
}

/// Bounces of a path that starts by a specular lobe: one more than `rt_bounces`, as for a path behind a mirror, so that the
/// surface that its first ray hits has all bounces of a visible one. Live frames without rough `metal` save it: other
/// surfaces reflect little.
pub fn specular_bounces(settings: &Settings, metal: bool) -> u32 {
    let bounces = settings.rt_bounces.min(MOST_BOUNCES);
    if settings.rt_accumulate || metal {
        bounces + 1
    } else {
        bounces.max(1)
    }
}

/// Records the passes that gather bounced light, by `samples` paths for each pixel that gathers. Where all pixels
/// gather, the four of a cell take turns, so that the paths of a quarter of the pixels need memory.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record(
    passes: &mut FramePasses<'_>,
    transport: &TransportView,
    samples: u32,
) -> Result<(), Error> {
    let parts = if passes.facts.subsampled { 1 } else { 4 };
    if passes.facts.adaptive {
        passes.run(Pass::BounceSelect)?;
    }
    // the number of the path is in the bits above those of the pixel
    let runs =
        (0..samples).flat_map(|path| (0..parts).map(move |part| part | path << t::PART_PATH_SHIFT));
    for part in runs {
        trace_path(passes, transport, transport.bounces, part)?;
    }
    if passes.facts.subsampled {
        passes.run(Pass::BounceUpsample)?;
    }
    Ok(())
}

/// Records the passes that gather the specular light of rough surfaces, by one path for each pixel that gathers.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record_specular(
    passes: &mut FramePasses<'_>,
    transport: &TransportView,
) -> Result<(), Error> {
    let parts = if passes.facts.subsampled { 1 } else { 4 };
    for part in (0..parts).map(|part| part | t::PART_SPECULAR) {
        passes.run_numbered(Pass::SpecularLight, 0, part)?;
        trace_path(passes, transport, transport.specular_bounces, part)?;
    }
    Ok(())
}

/// Records the filter of that light, if one of 2 × 2 pixels has gathered it; after the denoiser, whose gradients it reads.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn filter_specular(passes: &mut FramePasses<'_>) -> Result<(), Error> {
    if passes.facts.gloss && passes.facts.subsampled {
        passes.run(Pass::SpecularTemporal)?;
        passes.run(Pass::SpecularFilter)?;
    }
    Ok(())
}

/// Records the bounces of the paths of one pixel of each cell.
fn trace_path(
    passes: &mut FramePasses<'_>,
    transport: &TransportView,
    bounces: u32,
    part: u32,
) -> Result<(), Error> {
    let specular = part & t::PART_SPECULAR != 0;
    for bounce in 0..bounces {
        // mirrors light diffuse vertices
        if transport.mirror_count > 0 && !(specular && bounce == 0) {
            passes.run_numbered(Pass::MirrorLight, bounce, part)?;
        }
        if passes.facts.screen && !specular && bounce == 0 {
            passes.run_numbered(Pass::ScreenMarch, bounce, part)?;
        }
        passes.run_numbered(Pass::BounceRays, bounce, part)?;
        let shade = if bounce + 1 < bounces {
            Pass::BounceShade
        } else {
            Pass::BounceShadeLast
        };
        passes.run_numbered(shade, bounce, part)?;
        passes.run_numbered(Pass::BounceLight, bounce, part)?;
    }
    Ok(())
}

/// Clears bounced light, unless it is black. The adaptive denoiser, whose image holds other data meanwhile, does not
/// read it.
///
/// # Errors
/// Out of memory.
pub fn clear(targets: &mut Targets, passes: &mut FramePasses<'_>) -> Result<(), Error> {
    if let Some(indirect) = &targets.indirect
        && !targets.indirect_is_black
    {
        let (rec, access) = (&mut *passes.rec, Access::TRANSFER);
        let mut pass = rec.pass("trace_no_indirect", access, access)?;
        pass.clear_image(indirect, [0.0; 4]);
        targets.indirect_is_black = true;
    }
    passes.wrote(Resource::IndirectLight);
    Ok(())
}
