//! Which passes are compiled before a frame runs them, so that their pipelines are compiled at once and not one by one.

use super::first_hits;
use super::light_selection::{reuses_samples, samples_one_light};
use super::pass_set::PassSet;
use super::passes::{Pass, Switch};
use super::{
    antialias, denoise, feedback, indirect, light_selection, photons, screen, vertex_light,
};
use crate::gpu::Error;
use crate::settings::{Anaglyph, DenoiserChoice, Settings};

/// Passes that the settings decide about, or that every frame runs, the slowest to compile first. Others are
/// compiled when a frame first runs them.
const AHEAD: [Pass; 46] = [
    Pass::Primary,
    Pass::VertexGather,
    Pass::BounceShadeLast,
    Pass::BounceShade,
    Pass::Temporal,
    Pass::PrimarySimple,
    Pass::SampledDirect,
    Pass::ReservoirReuse,
    Pass::ReservoirSamples,
    Pass::Direct,
    Pass::Suns,
    Pass::BounceLight,
    Pass::BounceRays,
    Pass::MirrorLight,
    Pass::SpecularLight,
    Pass::PrimaryRays,
    Pass::FirstHits,
    Pass::SampleLights,
    Pass::WaveletFirst,
    Pass::WaveletSecond,
    Pass::WaveletLast,
    Pass::Antialias,
    Pass::Composite,
    Pass::Gradient,
    Pass::GradientReproject,
    Pass::GradientSample,
    Pass::GradientWide,
    Pass::Histogram,
    Pass::Exposure,
    Pass::BounceUpsample,
    Pass::Photons,
    Pass::PhotonCells,
    Pass::SpecularTemporal,
    Pass::SpecularFilter,
    Pass::ToneMap,
    Pass::SparseTemporal,
    Pass::SparseFilter,
    Pass::BloomDown,
    Pass::BloomUp,
    Pass::ScreenSurface,
    Pass::ScreenMarch,
    Pass::ScreenLight,
    Pass::BounceSelect,
    Pass::MoreSamples,
    Pass::VertexWrite,
    Pass::VertexSplit,
];
/// Passes that only maps with fog run.
const FOG_AHEAD: [Pass; 2] = [Pass::FogLight, Pass::FogFilter];

/// Whether frames with these settings run a pass of [`AHEAD`] on a map.
fn is_chosen(pass: Pass, settings: &Settings, needs: MapNeeds) -> bool {
    let gloss = needs.has_gloss(settings);
    match pass {
        Pass::SampleLights | Pass::SampledDirect | Pass::Suns => {
            samples_one_light(settings) && !reuses_samples(settings)
        }
        Pass::ReservoirSamples | Pass::ReservoirReuse => reuses_samples(settings),
        Pass::Direct => !samples_one_light(settings),
        Pass::BounceShade => {
            settings.rt_bounces > 1
                || gloss && indirect::specular_bounces(settings, needs.metal) > 1
        }
        Pass::MirrorLight | Pass::BounceRays | Pass::BounceShadeLast | Pass::BounceLight => {
            settings.rt_bounces > 0 || gloss
        }
        Pass::ScreenSurface | Pass::ScreenMarch | Pass::ScreenLight => screen::in_use(settings),
        Pass::FirstHits => first_hits::in_use(settings),
        Pass::BounceSelect => indirect::is_adaptive(settings),
        Pass::VertexSplit | Pass::VertexGather | Pass::VertexWrite => {
            vertex_light::in_use(settings)
        }
        Pass::SpecularLight => gloss,
        Pass::Photons | Pass::PhotonCells => needs.bodies && photons::in_use(settings),
        Pass::BounceUpsample => indirect::is_subsampled(settings, false),
        Pass::SpecularTemporal | Pass::SpecularFilter => {
            gloss && indirect::is_subsampled(settings, true)
        }
        Pass::Temporal
        | Pass::WaveletFirst
        | Pass::WaveletSecond
        | Pass::WaveletLast
        | Pass::Gradient
        | Pass::GradientReproject
        | Pass::GradientSample
        | Pass::GradientWide => denoise::in_use(settings) == DenoiserChoice::ASvgf,
        Pass::SparseTemporal | Pass::SparseFilter => {
            denoise::in_use(settings) == DenoiserChoice::Sparse
        }
        Pass::BloomDown | Pass::BloomUp => settings.rt_bloom > 0.0,
        Pass::MoreSamples => antialias::traces_more(settings),
        Pass::Antialias => antialias::is_temporal(settings),
        _ => true,
    }
}

/// Facts about a map that decide which passes its frames run.
#[derive(Clone, Copy, Debug, Default)]
pub struct MapNeeds {
    /// It has fog.
    pub fog: bool,
    /// It has flat mirrors.
    pub mirrors: bool,
    /// It has refracting bodies.
    pub bodies: bool,
    /// Materials other than glass are rough or have normal maps.
    pub gloss: bool,
    /// Normal maps have heights.
    pub heights: bool,
    /// Materials are rough, glass included, or have normal maps.
    pub frosted: bool,
    /// A rough material reflects more than most that are no metal.
    pub metal: bool,
}

impl MapNeeds {
    /// Whether frames with these settings run the passes of rough surfaces.
    fn has_gloss(&self, settings: &Settings) -> bool {
        let used = self.gloss || self.frosted && settings.rt_accumulate;
        settings.rt_specular && used
    }
}

/// The states of a pass's switches that occur, one bit for each switch.
fn states(pass: Pass, settings: &Settings, needs: MapNeeds) -> Vec<usize> {
    let mut states = vec![0];
    for ((_, switch), bit) in pass.row().switches.iter().zip(0..) {
        let on = match switch {
            Switch::Bounces => settings.rt_bounces > 0,
            Switch::MapFog | Switch::LitFog => needs.fog,
            Switch::Gloss => needs.has_gloss(settings),
            Switch::Heights => {
                needs.heights && settings.rt_specular && settings.parallax_mapping > 0
            }
            Switch::Caustics => needs.bodies && photons::in_use(settings),
            Switch::Timed => false,
            Switch::BlueNoise => settings.rt_blue_noise,
            Switch::ScreenHits => screen::in_use(settings),
            Switch::Adaptive => indirect::is_adaptive(settings),
            Switch::Roulette => settings.rt_bounce_roulette,
            Switch::CutOuts => settings.rt_cutouts > 0,
            Switch::LightTree => light_selection::uses_tree(settings),
            Switch::SharedEyes => settings.rt_share_eyes && settings.anaglyph != Anaglyph::None,
            Switch::Ambient => indirect::adds_ambient(settings),
            Switch::MoreSamples => antialias::traces_more(settings),
            Switch::SmoothMaximum => antialias::smooths_maximum(settings),
            Switch::Feedback => feedback::in_use(settings),
            Switch::VertexLight => vertex_light::in_use(settings),
        };
        if !on {
            continue;
        }
        let with = states.iter().map(|state| state | 1 << bit).collect();
        if matches!(
            switch,
            Switch::LitFog | Switch::ScreenHits | Switch::SharedEyes
        ) {
            // fog out of sight is not lit; the first frame has no last picture; the first eye has no other
            states.extend::<Vec<usize>>(with);
        } else {
            states = with;
        }
    }
    states
}

/// Compiles what frames with these settings run on a map and `passes` lacks.
///
/// # Errors
/// The driver refuses a pipeline.
pub fn compile_ahead(passes: &PassSet, settings: &Settings, needs: MapNeeds) -> Result<(), Error> {
    let fog: &[Pass] = if needs.fog { &FOG_AHEAD } else { &[] };
    let is_needed = |pass: &Pass| *pass != Pass::MirrorLight || needs.mirrors;
    let chosen = AHEAD
        .iter()
        .filter(|&&pass| is_chosen(pass, settings, needs) && is_needed(&pass));
    passes.compile_missing(chosen.chain(fog).flat_map(|&pass| {
        let states = states(pass, settings, needs);
        states.into_iter().map(move |state| (pass, state))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::PRESETS;

    /// Whether frames of a preset run each of these passes.
    fn of_preset<const N: usize>(name: &str, passes: [Pass; N]) -> [bool; N] {
        let preset = PRESETS.iter().find(|preset| preset.name == name);
        let mut settings = Settings::full_size();
        preset
            .expect("a preset")
            .put(&mut settings)
            .expect("its values");
        passes.map(|pass| AHEAD.contains(&pass) && is_chosen(pass, &settings, MapNeeds::default()))
    }

    #[test]
    fn presets_have_the_passes_of_their_bounces_and_filters() {
        use Pass::{Antialias, BounceShadeLast, Direct, SparseFilter, Temporal};
        let passes = [BounceShadeLast, Temporal, SparseFilter, Antialias, Direct];
        let low = of_preset("low", passes);
        assert_eq!(low, [false, true, false, true, false]);
        let high = of_preset("high", passes);
        assert_eq!(high, [true, true, false, true, false]);
        let reference = of_preset("reference", passes);
        assert_eq!(reference, [true, false, false, false, true]);
    }
}
