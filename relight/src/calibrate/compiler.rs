//! What the map compiler did to light before storing it: gamma, light cutoff, dirt.
//!
//! * *Gamma* (`-gamma`): the compiler stores (L / 255)^(1 / g). Irradiance is linear in the lights only before this
//!   step. Taken as linear, bright light is too weak relative to dim light: the fit weakens suns and adds lights to
//!   fill the residual.
//! * *Light cutoff* (`-fast`): the compiler leaves out a light where it adds less than one step of light, so many
//!   weak lights end early.
//! * *Dirt* (`-dirty`): the compiler multiplies light by ambient occlusion.
//!
//! If the map has the compiler's command line ([`compiler_command_line`]), it decides. Otherwise fits with fewer
//! samples (trials) test gammas, the cutoff and dirt. A setting is accepted if it lowers the error of *stored*
//! light clearly; a gamma also needs a second gamma to lower it, and must not contradict the directives. Trials
//! have equal freedom, so they are compared at all texels: a fifth of the texels is too noisy.

use super::compiler_command_line::{self, CommandLine};
use super::dirt::Dirt;
use super::fit::ROUNDS;
use super::trace_cache::TraceCache;
use super::{CalibrationCache, CalibrationOptions, CalibrationReport, Evidence, FitMode, Solution};
use crate::world::RelitWorld;

/// Gammas that are tried: about the display's, and two between it and 1.
const TRIED_GAMMAS: [f32; 3] = [1.4, 1.8, 2.2];

/// Gamma that is tried first: if light was encoded with any of them, this one lowers the error.
const FIRST_GAMMA: f32 = 1.8;

/// Ratio to the error without gamma that the best gamma must reach.
const GAMMA_KEPT: f32 = 0.87;

/// Ratio that the first and a second gamma must reach.
const GAMMA_SUPPORTED: f32 = 0.92;

/// Ratio to the best error within which gammas count as equal. The largest of them is taken: compilers are usually
/// set to the display's gamma.
const GAMMA_ALIKE: f32 = 1.07;

/// Ratio to the best error without gamma, with or without cutoff, that the final choice must reach.
const GAMMA_KEPT_IN_ALL: f32 = 0.92;

/// Ratio to the error without cutoff that the cutoff must reach.
const CUTOFF_KEPT: f32 = 0.95;

/// Ratio of the errors with and without dirt in which trials cannot decide. Below it there is dirt, above it none.
const DIRT_IN_DOUBT: std::ops::RangeInclusive<f32> = 0.88..=1.1;

/// The same for the light cutoff.
const CUTOFF_IN_DOUBT: std::ops::RangeInclusive<f32> = CUTOFF_KEPT..=1.08;

/// Error ratio that dirt or a cutoff must then reach in fits with all samples and candidates.
const ALL_SAMPLES_KEPT: f32 = 0.96;

/// Rounds of placement in these fits.
const ALL_SAMPLES_ROUNDS: usize = 2;

/// Largest ratio of the directives' error with a gamma to that without one: the compiler read the directives.
const CONTRADICTED: f32 = 1.5;

/// Error that needs no further explanation, stops.
pub(super) const NO_ERROR: f32 = 0.01;

/// Smallest number of samples of a trial.
const TRIAL_SAMPLES: usize = 1000;

/// Light cutoff in steps of 1 / 255 before the compiler's gamma.
const CUTOFF_STEPS: f32 = 1.0;

/// Plausible gammas of a compiler.
const POSSIBLE: std::ops::RangeInclusive<f32> = 0.5..=4.0;

/// Whether a number is a plausible gamma.
pub(super) fn possible(gamma: f32) -> bool {
    POSSIBLE.contains(&gamma)
}

/// What a compiler did to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compiler {
    /// Encoding gamma; 1 for none.
    pub gamma: f32,
    /// Whether lights have a cutoff.
    pub has_cutoff: bool,
    /// Ambient occlusion, if any.
    pub dirt: Option<Dirt>,
    /// Whether the fit may use back splashes ([`splash`](super::splash)).
    pub splashes: bool,
}

impl Compiler {
    /// A compiler that stores light unchanged.
    const PLAIN: Compiler = Compiler {
        gamma: 1.0,
        has_cutoff: false,
        dirt: None,
        splashes: true,
    };

    /// The settings of a finished calibration that the world has.
    pub fn of(report: &CalibrationReport) -> Compiler {
        Compiler {
            gamma: report.gamma,
            has_cutoff: report.has_cutoff,
            ..Compiler::PLAIN
        }
    }

    /// Sets the world's gamma and light cutoff.
    pub fn apply_to(self, world: &mut RelitWorld) {
        (world.stored_gamma, world.light_cutoff) = (self.gamma, self.light_cutoff());
    }

    /// The value of [`RelitWorld::light_cutoff`]. A stored byte of 255 is light 4 (the overbright shift) to the
    /// power of gamma; one step before encoding is 1 / 255 of it.
    fn light_cutoff(self) -> f32 {
        if self.has_cutoff {
            CUTOFF_STEPS / 255.0 * 4.0f32.powf(self.gamma)
        } else {
            0.0
        }
    }
}

/// The settings that remain possible for a world's compiler: those of its command line, else those that explain its
/// light best. Where there are two, both must be fitted to completion. `progress` gets the completed part.
///
/// Trials treat cut-outs as fully transparent: the noise of single rays through a grate would favour a wrong gamma.
pub(super) fn find(
    world: &mut RelitWorld,
    unknown_skies: &[u32],
    options: &CalibrationOptions,
    traced: &mut TraceCache,
    progress: &mut dyn FnMut(f32),
) -> Vec<Compiler> {
    let line = compiler_command_line::command_line(&world.bsp.entities());
    if let Some(line) = line {
        return from_command_line(line);
    }
    let holes: Vec<_> = (world.materials.iter_mut().map(|m| m.holes.take())).collect();
    let mut trials = Trials {
        world,
        unknown_skies,
        options,
        less: CalibrationOptions {
            samples: (options.samples / 3)
                .max(TRIAL_SAMPLES)
                .min(options.samples),
            candidates: options.candidates / 5,
            cache: None::<CalibrationCache>,
            ..*options
        },
        traced,
        progress,
        done: Vec::new(),
        with_all_samples: Vec::new(),
    };
    let found = trials.best_by_stored_light().unwrap_or(Compiler::PLAIN);
    for (material, holes) in world.materials.iter_mut().zip(holes) {
        material.holes = holes;
    }
    vec![found]
}

/// The settings of a command line, with and without its dirt: stored light of some maps contradicts the command line,
/// and trials mistake missing lights for dirt.
fn from_command_line(line: CommandLine) -> Vec<Compiler> {
    let with = |dirt| Compiler {
        gamma: line.gamma,
        has_cutoff: line.has_cutoff,
        dirt,
        ..Compiler::PLAIN
    };
    let dirty = line.dirt.map(|dirt| with(Some(dirt)));
    dirty.into_iter().chain([with(None)]).collect()
}

/// Fits with fewer samples and candidates.
struct Trials<'a> {
    world: &'a mut RelitWorld,
    unknown_skies: &'a [u32],
    options: &'a CalibrationOptions,
    less: CalibrationOptions,
    traced: &'a mut TraceCache,
    progress: &'a mut dyn FnMut(f32),
    /// Finished trials: [error of the directives, error of the fit], stops.
    done: Vec<(Compiler, Option<[f32; 2]>)>,
    /// Finished fits with all samples, and their errors, stops.
    with_all_samples: Vec<(Compiler, f32)>,
}

impl Trials<'_> {
    /// Errors of the directives and of the fit for a setting, stops.
    fn error(&mut self, compiler: Compiler) -> Option<[f32; 2]> {
        if let Some((_, errors)) = self.done.iter().find(|(tried, _)| *tried == compiler) {
            return *errors;
        }
        (self.progress)(self.done.len() as f32 / (4.0 + TRIED_GAMMAS.len() as f32));
        // Trials use surface samples and inverse-square lights only.
        let less = self.less.clone();
        let found = self.fit(compiler, &less, FitMode::Trial(ROUNDS))?;
        let errors = [found.report.before.median_stops, found.overall.median_stops];
        let errors = (found.report.evidence != Evidence::Nothing).then_some(errors);
        self.done.push((compiler, errors));
        errors
    }

    /// A fit with a setting.
    fn fit(
        &mut self,
        compiler: Compiler,
        options: &CalibrationOptions,
        mode: FitMode<'_>,
    ) -> Option<Solution> {
        compiler.apply_to(self.world);
        let (world, unknown_skies, traced) = (&*self.world, self.unknown_skies, &mut *self.traced);
        let found = super::find(
            world,
            unknown_skies,
            options,
            compiler,
            mode,
            traced,
            &mut |_| (),
        );
        Compiler::PLAIN.apply_to(self.world);
        found
    }

    /// The setting that explains the stored light best, if it is clearly better.
    fn best_by_stored_light(&mut self) -> Option<Compiler> {
        let clean = self.gamma_and_cutoff()?;
        let dirty = Compiler {
            dirt: Some(Dirt::DEFAULT),
            ..clean
        };
        let part = self.error_ratio(dirty, clean)?;
        let dirty = if DIRT_IN_DOUBT.contains(&part) {
            self.is_better_with_all_samples(dirty, clean)
        } else {
            part < *DIRT_IN_DOUBT.start()
        };
        let dirt = dirty.then_some(Dirt::DEFAULT);
        let found = Compiler { dirt, ..clean };
        let with_cutoff = Compiler {
            has_cutoff: true,
            ..clean
        };
        let in_doubt = |part: &f32| !clean.has_cutoff && CUTOFF_IN_DOUBT.contains(part);
        if self
            .error_ratio(with_cutoff, clean)
            .is_some_and(|p| in_doubt(&p))
        {
            let with_cutoff = Compiler {
                dirt,
                ..with_cutoff
            };
            return Some(match self.is_better_with_all_samples(with_cutoff, found) {
                true => with_cutoff,
                false => found,
            });
        }
        Some(found)
    }

    /// Error with setting `of` over error with setting `with`.
    fn error_ratio(&mut self, of: Compiler, with: Compiler) -> Option<f32> {
        let [[_, of], [_, with]] = [self.error(of)?, self.error(with)?];
        Some(of / with)
    }

    /// Whether one setting has a clearly lower error than another with all samples and candidates; for cases that
    /// trials cannot decide, because the error of missing lights hides the compiler's.
    fn is_better_with_all_samples(&mut self, one: Compiler, than: Compiler) -> bool {
        let mut error = |compiler| {
            if let Some((_, error)) = self
                .with_all_samples
                .iter()
                .find(|(tried, _)| *tried == compiler)
            {
                return *error;
            }
            let found = self.fit(compiler, self.options, FitMode::Trial(ALL_SAMPLES_ROUNDS));
            let error = found.map_or(f32::INFINITY, |found| found.overall.median_stops);
            self.with_all_samples.push((compiler, error));
            error
        };
        error(one) < error(than) * ALL_SAMPLES_KEPT
    }

    /// Decides the gamma and the cutoff.
    fn gamma_and_cutoff(&mut self) -> Option<Compiler> {
        let [directives, without_cutoff] =
            self.error(Compiler::PLAIN).filter(|[_, e]| *e > NO_ERROR)?;
        let with_cutoff = Compiler {
            has_cutoff: true,
            ..Compiler::PLAIN
        };
        let cutoff_error = self.error(with_cutoff).map_or(f32::INFINITY, |[_, e]| e);
        let linear = Compiler {
            has_cutoff: cutoff_error < without_cutoff * CUTOFF_KEPT,
            ..Compiler::PLAIN
        };
        let fallback = self.world.report.fallback;
        let mut trial = |compiler: Compiler| {
            let [before, after] = self.error(compiler)?;
            // In a map without any light, loading added a fallback, which is no evidence.
            (fallback || before <= directives * CONTRADICTED).then_some(after)
        };
        // Gammas are compared without a cutoff: the cutoff depends on the gamma.
        let with = |gamma| Compiler {
            gamma,
            ..Compiler::PLAIN
        };
        let Some(first) =
            trial(with(FIRST_GAMMA)).filter(|e| *e < without_cutoff * GAMMA_SUPPORTED)
        else {
            return Some(linear);
        };
        let mut found: Vec<(f32, f32)> = TRIED_GAMMAS
            .into_iter()
            .filter(|gamma| *gamma != FIRST_GAMMA)
            .filter_map(|gamma| Some((trial(with(gamma))?, gamma)))
            .collect();
        found.push((first, FIRST_GAMMA));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(best, _), (next, _), ..] = found[..] else {
            return Some(linear);
        };
        if best >= without_cutoff * GAMMA_KEPT || next >= without_cutoff * GAMMA_SUPPORTED {
            return Some(linear);
        }
        let alike = found.into_iter().filter(|(e, _)| *e <= best * GAMMA_ALIKE);
        let (error, gamma) = alike.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let with_cutoff = Compiler {
            has_cutoff: true,
            ..with(gamma)
        };
        let with_cutoff_error = trial(with_cutoff).unwrap_or(f32::INFINITY);
        let has_cutoff = with_cutoff_error < error * CUTOFF_KEPT;
        let none = without_cutoff.min(cutoff_error);
        if error.min(with_cutoff_error) >= none * GAMMA_KEPT_IN_ALL {
            return Some(linear);
        }
        Some(Compiler {
            has_cutoff,
            ..with(gamma)
        })
    }
}
