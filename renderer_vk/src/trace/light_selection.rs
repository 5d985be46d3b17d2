//! What the settings say about the sampling of lights, and the passes of direct light.

use shaders::trace_types::TraceView;
use shaders::trace_types::constants as c;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::Error;
use crate::settings::{LightSelection, Settings};

/// Whether surfaces are lit; otherwise they show their albedo.
pub fn is_lit(settings: &Settings) -> bool {
    settings.rt_illumination && !settings.fullbright
}

/// Estimator of direct light (`SELECT_*`).
pub fn estimator(settings: &Settings) -> u32 {
    match settings.rt_light_selection {
        _ if settings.rt_num_random_dl == 0 => c::SELECT_ALL,
        LightSelection::Uniform => c::SELECT_UNIFORM,
        LightSelection::Resampled | LightSelection::Tree | LightSelection::Reused => {
            c::SELECT_RESAMPLED
        }
    }
}

/// Whether each pixel samples a single light, in a pass of its own.
pub fn samples_one_light(settings: &Settings) -> bool {
    is_lit(settings)
        && estimator(settings) == c::SELECT_RESAMPLED
        && settings.rt_num_random_dl == 1
        && settings.rt_samples == 1
}

/// Whether pixels reuse the light samples of their neighbours and of the last frame.
pub fn reuses_samples(settings: &Settings) -> bool {
    settings.rt_light_selection == LightSelection::Reused && samples_one_light(settings)
}

/// Whether lights are drawn from the tree in place of the lists.
pub fn uses_tree(settings: &Settings) -> bool {
    settings.rt_light_selection == LightSelection::Tree
        && estimator(settings) == c::SELECT_RESAMPLED
}

/// Records the passes of direct light.
///
/// # Errors
/// Out of memory, or the driver refuses a pipeline.
pub fn record(
    passes: &mut FramePasses<'_>,
    settings: &Settings,
    params: &TraceView,
) -> Result<(), Error> {
    if !samples_one_light(settings) {
        return passes.run(Pass::Direct);
    }
    passes.run(Pass::SampleLights)?;
    passes.run(Pass::SampledDirect)?;
    if params.lights.sun_count > 0 {
        passes.run(Pass::Suns)?;
    }
    Ok(())
}
