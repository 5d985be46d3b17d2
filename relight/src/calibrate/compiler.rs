//! What the map's compiler did to light: with which gamma it encoded it, whether it let lights end, whether it made corners
//! darker.
//!
//! Compilers store light as it is unless told otherwise; told so (`-gamma`), they store (L / 255)^(1 / g). Light is linear in
//! its sources only as it was before: taken for linear, bright light is too weak
//! beside dim light, suns are turned down, and lights are put in to fill what is left. To save time (`-fast`) they leave
//! out of a texel what a light adds less than a step of light to, so that all light of many weak lights has an end. And they
//! may multiply it by the part of the surroundings that is open (`-dirty`). Some maps say what was done ([`compiler_command_line`]); else a
//! map is fitted with less effort for some gammas, with lights that end, and with dirt, and one of them is believed where it leaves
//! much less unexplained *of what is stored*, of gammas another leaves less as well, and the light that directives tell of
//! does not speak against it. Compared is the error at all texels, fitted ones too: these fits have the same freedom, and a
//! fifth of the texels would leave the choice to chance.

use super::compiler_command_line::{self, CommandLine, Dirt};
use super::fit::ROUNDS;
use super::trace_cache::TraceCache;
use super::{CalibrationCache, CalibrationOptions, CalibrationReport, Evidence, FitMode, Solution};
use crate::world::RelitWorld;

/// Gammas tried: about the display's own, and two between it and none.
const TRIED_GAMMAS: [f32; 3] = [1.4, 1.8, 2.2];

/// The one that is tried first: were light encoded with any of them, it would explain more than none.
const FIRST_GAMMA: f32 = 1.8;

/// Part of the error without gamma that the best may leave to be believed.
const GAMMA_KEPT: f32 = 0.87;

/// Part that one more of them may leave, and the first, for the others to be tried.
const GAMMA_SUPPORTED: f32 = 0.92;

/// Gammas that explain light nearly as well as the best, a factor of the error: of these the largest is believed, as the
/// display's own is what compilers are told as a rule.
const GAMMA_ALIKE: f32 = 1.07;

/// Part of the error without gamma that may be left with all that is found.
const GAMMA_KEPT_IN_ALL: f32 = 0.92;

/// Part of the error of lights without an end that such with an end may leave to be believed.
const CUTOFF_KEPT: f32 = 0.95;

/// Part of the error without dirt that dirt which no command line tells of leaves, where fits with less effort cannot tell
/// whether it is there. What leaves less is dirty, what leaves more is not.
const DIRT_IN_DOUBT: std::ops::RangeInclusive<f32> = 0.88..=1.1;

/// Part of the error of lights without an end that such with an end leave, where these fits cannot tell.
const CUTOFF_IN_DOUBT: std::ops::RangeInclusive<f32> = CUTOFF_KEPT..=1.08;

/// Part of the error that dirt or an end leaves then, with all measurements and candidates, to be believed.
const ALL_SAMPLES_KEPT: f32 = 0.96;

/// Times that lights are looked for to tell.
const ALL_SAMPLES_ROUNDS: usize = 2;

/// How many times as far off as without gamma what directives say may be: it was the compiler that read them.
const CONTRADICTED: f32 = 1.5;

/// Error that leaves nothing to be explained, stops.
pub(super) const NO_ERROR: f32 = 0.01;

/// Least measurements of a trial.
const TRIAL_SAMPLES: usize = 1000;

/// Light, in steps of 1 / 255 as compilers count it before their gamma, at which lights end.
const CUTOFF_STEPS: f32 = 1.0;

/// Gammas that a compiler can be told.
const POSSIBLE: std::ops::RangeInclusive<f32> = 0.5..=4.0;

/// Whether a number can be the gamma of a compiler.
pub(super) fn possible(gamma: f32) -> bool {
    POSSIBLE.contains(&gamma)
}

/// What a compiler did to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compiler {
    /// What it encoded light with; 1 for nothing.
    pub gamma: f32,
    /// Whether its lights end.
    pub has_cutoff: bool,
    /// How it made corners darker.
    pub dirt: Option<Dirt>,
    /// Whether weak lights may stand in front of lamps ([`splash`](super::splash)).
    pub splashes: bool,
}

impl Compiler {
    /// Stores light as it is.
    const PLAIN: Compiler = Compiler {
        gamma: 1.0,
        has_cutoff: false,
        dirt: None,
        splashes: true,
    };

    /// What was found before, as far as the world knows of it.
    pub fn of(report: &CalibrationReport) -> Compiler {
        Compiler {
            gamma: report.gamma,
            has_cutoff: report.has_cutoff,
            ..Compiler::PLAIN
        }
    }

    /// Lets the world know.
    pub fn apply_to(self, world: &mut RelitWorld) {
        (world.stored_gamma, world.light_cutoff) = (self.gamma, self.light_cutoff());
    }

    /// The value of [`RelitWorld::light_cutoff`]. A stored byte of 255 is light of 4 (the engine's overbright shift), to the
    /// power of gamma: a step of what was encoded is a 255th of that.
    fn light_cutoff(self) -> f32 {
        if self.has_cutoff {
            CUTOFF_STEPS / 255.0 * 4.0f32.powf(self.gamma)
        } else {
            0.0
        }
    }
}

/// What a world's compiler did: what the map says of it, else what explains its light. Where it is two things, light has to
/// be found with both to tell. `progress` gets the part that is done.
///
/// Cut-outs let all light through here: that single rays are let through by a grate or not is noise, which a wrong gamma
/// would seem to explain.
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
    let found = trials.from_stored_light().unwrap_or(Compiler::PLAIN);
    for (material, holes) in world.materials.iter_mut().zip(holes) {
        material.holes = holes;
    }
    vec![found]
}

/// What a command line says. Dirt may not be there: not all maps look like what their command lines say of it, and fits with
/// less effort take for dirt what they lack lights for.
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

/// Fits with less effort.
struct Trials<'a> {
    world: &'a mut RelitWorld,
    unknown_skies: &'a [u32],
    options: &'a CalibrationOptions,
    less: CalibrationOptions,
    traced: &'a mut TraceCache,
    progress: &'a mut dyn FnMut(f32),
    /// Those that are done, and their errors.
    done: Vec<(Compiler, Option<[f32; 2]>)>,
    /// Fits with all measurements, and their errors.
    with_all_samples: Vec<(Compiler, f32)>,
}

impl Trials<'_> {
    /// Error of what directives say, and of what is fitted.
    fn error(&mut self, compiler: Compiler) -> Option<[f32; 2]> {
        if let Some((_, errors)) = self.done.iter().find(|(tried, _)| *tried == compiler) {
            return *errors;
        }
        (self.progress)(self.done.len() as f32 / (4.0 + TRIED_GAMMAS.len() as f32));
        // What is stored on surfaces decides, with lights that fall off as light does.
        let less = self.less.clone();
        let found = self.fit(compiler, &less, FitMode::Trial(ROUNDS))?;
        let errors = [found.report.before.median_stops, found.overall.median_stops];
        let errors = (found.report.evidence != Evidence::Nothing).then_some(errors);
        self.done.push((compiler, errors));
        errors
    }

    /// A fit for a compiler.
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

    /// What explains the map's light best, if it does so by far.
    fn from_stored_light(&mut self) -> Option<Compiler> {
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

    /// Part of the error with one compiler that another leaves.
    fn error_ratio(&mut self, of: Compiler, with: Compiler) -> Option<f32> {
        let [[_, of], [_, with]] = [self.error(of)?, self.error(with)?];
        Some(of / with)
    }

    /// Whether one leaves less of the error than another with all measurements and candidates, where fits with less effort
    /// cannot tell: what they lack lights for hides what the compiler did.
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

    /// The gamma, and whether lights end.
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
            // A map without any light has what loading put there in its place.
            (fallback || before <= directives * CONTRADICTED).then_some(after)
        };
        // Like is compared with like: ends that belong to one gamma mislead with another.
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
