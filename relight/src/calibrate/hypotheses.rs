//! Hypotheses: the combinations of compiler settings, back splashes and sample counts that are fitted. The one with
//! the smallest error at held-out samples is kept.
//!
//! Every hypothesis is fitted to completion; early residuals mislead because the ambient term is released last, and
//! dirt and back splashes trade off against it. A repetition with more samples is abandoned as soon as it cannot
//! beat the best fit.

use super::compiler::{self, Compiler};
use super::trace_cache::TraceCache;
use super::{Acceptance, CalibrationOptions, FitMode, Solution, find};
use crate::world::RelitWorld;
use std::cell::Cell;

/// Part of the time that the search for the compiler's settings takes.
const COMPILER_PART: f32 = 0.3;

/// Part of the time after which the planned hypotheses are done; a fit with more samples may follow.
const TRIED_PART: f32 = 0.85;

/// Held-out error above which more samples are taken, stops: many small lights need more evidence.
pub(super) const UNEXPLAINED: f32 = 0.3;

/// Part of the directives' error above which more samples are taken.
pub(super) const HALF: f32 = 0.5;

/// Factor of the number of samples.
const MORE_SAMPLES: usize = 2;

/// Part of the error without back splashes that they may leave to be kept if they are more lights.
const SPLASHES_KEPT: f32 = 0.95;

/// Largest ratio of the errors after a round at which a fit may still catch up with the best one.
const BEHIND: f32 = 1.03;

/// State shared by all hypotheses.
pub(super) struct Hypotheses<'a> {
    world: &'a mut RelitWorld,
    unknown_skies: &'a [u32],
    options: &'a CalibrationOptions,
    progress: &'a mut dyn FnMut(f32),
    traced: TraceCache,
    /// Completed part.
    reached: f32,
    /// Upper bound of the hypotheses to follow.
    left: usize,
}

/// The best solution over the possible compiler settings.
pub(super) fn best(
    world: &mut RelitWorld,
    unknown_skies: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> Solution {
    let mut reached = 0.0;
    let mut traced = TraceCache::default();
    let compilers = compiler::find(world, unknown_skies, options, &mut traced, &mut |part| {
        reached = part * COMPILER_PART;
        progress(reached);
    });
    let mut hypotheses = Hypotheses {
        traced,
        reached,
        left: 2 * compilers.len(),
        ..Hypotheses::new(world, unknown_skies, options, progress)
    };
    let mut best: Option<(Solution, Compiler)> = None;
    for compiler in compilers {
        let found = hypotheses.fit_with_and_without_splashes(compiler);
        if (best.as_ref()).is_none_or(|(best, _)| held_out_error(&found) < held_out_error(best)) {
            best = Some((found, compiler));
        }
    }
    let Some((found, compiler)) = best else {
        return Solution::default();
    };
    if held_out_error(&found) <= error_target(found.report.before.median_stops)
        || found.measured_more
    {
        return found;
    }
    let splashes = found.report.splashes > 0;
    let same = Compiler {
        splashes,
        ..compiler
    };
    let incumbent = Incumbent::of(&found);
    let again = hypotheses.measured_more(same, Some(&incumbent), &Cell::new(splashes), &|| 1.0);
    match again {
        Some(again) if held_out_error(&again) < held_out_error(&found) => again,
        _ => found,
    }
}

/// The best fit so far, which another fit must beat.
pub(super) struct Incumbent {
    /// Its error, stops.
    pub stops: f32,
    /// Largest error after each round, stops.
    pub round_limits: Vec<f32>,
}

impl Incumbent {
    /// The limits of a solution.
    pub fn of(found: &Solution) -> Incumbent {
        let after = found.rounds.iter();
        Incumbent {
            stops: held_out_error(found),
            round_limits: after.map(|left| left * BEHIND).collect(),
        }
    }
}

/// Error that calibration should reach for this error of the directives, stops.
pub(super) fn error_target(directives: f32) -> f32 {
    (directives * HALF).max(compiler::NO_ERROR)
}

/// Error at held-out samples, stops.
fn held_out_error(solution: &Solution) -> f32 {
    solution.report.after.median_stops
}

impl<'a> Hypotheses<'a> {
    /// No hypothesis fitted, none planned.
    pub fn new(
        world: &'a mut RelitWorld,
        unknown_skies: &'a [u32],
        options: &'a CalibrationOptions,
        progress: &'a mut dyn FnMut(f32),
    ) -> Hypotheses<'a> {
        Hypotheses {
            world,
            unknown_skies,
            options,
            progress,
            traced: TraceCache::default(),
            reached: 0.0,
            left: 0,
        }
    }

    /// The better solution with and without back splashes; one fit if the first uses none.
    fn fit_with_and_without_splashes(&mut self, compiler: Compiler) -> Solution {
        self.left = self.left.saturating_sub(2);
        let splashed = self.with(compiler);
        if splashed.report.splashes == 0 {
            return splashed;
        }
        let plain = Compiler {
            splashes: false,
            ..compiler
        };
        prefer(splashed, self.with(plain))
    }

    /// The solution for a setting, with more samples if it needs them.
    pub fn with(&mut self, compiler: Compiler) -> Solution {
        // A second fit without back splashes follows if the first uses them.
        let splashes = Cell::new(compiler.splashes);
        let (begin, left) = (self.reached, self.left);
        let end = &|| {
            let tries = left + 1 + usize::from(splashes.get());
            begin + (TRIED_PART - begin) / tries as f32
        };
        let acceptance = Acceptance {
            stops: UNEXPLAINED,
            round_limits: &[],
            splashes: &splashes,
        };
        let first = self.find(compiler, self.options, acceptance, end);
        // The second fit is taken whatever its error.
        first
            .or_else(|| self.measured_more(compiler, None, &splashes, end))
            .unwrap_or_default()
    }

    /// [`with`](Self::with) more samples. `None` as soon as it cannot beat the incumbent.
    pub fn measured_more(
        &mut self,
        compiler: Compiler,
        incumbent: Option<&Incumbent>,
        splashes: &Cell<bool>,
        end: &dyn Fn() -> f32,
    ) -> Option<Solution> {
        let options = CalibrationOptions {
            samples: self.options.samples * MORE_SAMPLES,
            cache: None,
            ..*self.options
        };
        let acceptance = Acceptance {
            stops: incumbent.map_or(f32::INFINITY, |incumbent| incumbent.stops),
            round_limits: incumbent.map_or(&[], |incumbent| &incumbent.round_limits[..]),
            splashes,
        };
        let found = self.find(compiler, &options, acceptance, end)?;
        Some(Solution {
            measured_more: true,
            ..found
        })
    }

    /// [`find`] with progress scaled up to `end`, as far as that is known.
    fn find(
        &mut self,
        compiler: Compiler,
        options: &CalibrationOptions,
        acceptance: Acceptance<'_>,
        end: &dyn Fn() -> f32,
    ) -> Option<Solution> {
        compiler.apply_to(self.world);
        let begin = self.reached;
        let (reached, report) = (&mut self.reached, &mut self.progress);
        find(
            self.world,
            self.unknown_skies,
            options,
            compiler,
            FitMode::Full(acceptance),
            &mut self.traced,
            &mut |part| {
                *reached = reached.max(begin + part * (end() - begin));
                report(*reached);
            },
        )
    }
}

/// Prefers the fit without back splashes unless they lower the error clearly or need fewer lights: in many maps
/// placed lights explain the same light.
fn prefer(splashed: Solution, plain: Solution) -> Solution {
    let added = |solution: &Solution| solution.report.splashes + solution.report.placed;
    let fewer =
        added(&splashed) <= added(&plain) && held_out_error(&splashed) <= held_out_error(&plain);
    if fewer || held_out_error(&splashed) < held_out_error(&plain) * SPLASHES_KEPT {
        splashed
    } else {
        plain
    }
}
