//! The ways in which a map's light is looked for: with what its compiler may have done, with back splashes and without, with
//! more measurements. What agrees best at texels held out is kept.
//!
//! Ways are gone to the end, because what an early round leaves tells little: how dark corners are, and what splashes
//! explain, hangs on ambient light, which is let grow last. More measurements of the same are given up as soon as they are
//! known to agree no better.

use super::compiler::{self, Compiler};
use super::trace_cache::TraceCache;
use super::{Acceptance, CalibrationOptions, FitMode, Solution, find};
use crate::world::RelitWorld;
use std::cell::Cell;

/// Part of the time that looking for what the compiler did takes, about.
const COMPILER_PART: f32 = 0.3;

/// Part of the time after which what was planned is tried: more measurements may follow.
const TRIED_PART: f32 = 0.85;

/// Error at measurements held out, stops, that asks for more measurements: light of many small lights takes more to tell.
pub(super) const UNEXPLAINED: f32 = 0.3;

/// Part of the error of what directives say that asks for more measurements, too, where more of it is left.
pub(super) const HALF: f32 = 0.5;

/// So many times as many.
const MORE_SAMPLES: usize = 2;

/// Part of the error without back splashes that they may leave to be kept, where they are more lights.
const SPLASHES_KEPT: f32 = 0.95;

/// How far behind a way may fall that still comes up to another in the end, a factor of the error after a round.
const BEHIND: f32 = 1.03;

/// What ways have in common.
pub(super) struct Hypotheses<'a> {
    world: &'a mut RelitWorld,
    unknown_skies: &'a [u32],
    options: &'a CalibrationOptions,
    progress: &'a mut dyn FnMut(f32),
    traced: TraceCache,
    /// The part that is done.
    reached: f32,
    /// Ways to be tried after this one, at most.
    left: usize,
}

/// The solution that agrees best, of what the compiler may have done.
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

/// What another way has to come up to.
pub(super) struct Incumbent {
    /// Most error that may be left, stops.
    pub stops: f32,
    /// Most that may be left after each round.
    pub round_limits: Vec<f32>,
}

impl Incumbent {
    /// No more than a solution has.
    pub fn of(found: &Solution) -> Incumbent {
        let after = found.rounds.iter();
        Incumbent {
            stops: held_out_error(found),
            round_limits: after.map(|left| left * BEHIND).collect(),
        }
    }
}

/// Error that calibration should leave at most, where directives leave this one, stops.
pub(super) fn error_target(directives: f32) -> f32 {
    (directives * HALF).max(compiler::NO_ERROR)
}

/// Error at measurements held out, stops.
fn held_out_error(solution: &Solution) -> f32 {
    solution.report.after.median_stops
}

impl<'a> Hypotheses<'a> {
    /// None tried yet, and none planned.
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

    /// What is found with a compiler's back splashes, or without where these are not needed.
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

    /// What is found with the measurements that it takes.
    pub fn with(&mut self, compiler: Compiler) -> Solution {
        // it is tried once more without splashes, unless there are none
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
        first
            .or_else(|| self.measured_more(compiler, None, &splashes, end))
            .unwrap_or_default()
    }

    /// [`with`](Self::with) more measurements. `None` as soon as it is known to agree no better than its rival.
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

    /// [`find`] that takes progress to `end`, as far as that is known.
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

/// What splashes explain, lights that are put in explain as well in many a map, and with fewer.
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
