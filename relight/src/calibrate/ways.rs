//! The ways in which a map's light is looked for: with what its compiler may have done, with back splashes and without, with
//! more measurements. What agrees best at texels held out is kept.
//!
//! Ways are gone to the end, because what an early round leaves tells little: how dark corners are, and what splashes
//! explain, hangs on ambient light, which is let grow last. More measurements of the same are given up as soon as they are
//! known to agree no better.

use super::compiler::{self, Compiler};
use super::memory::Memory;
use super::{Asked, CalibrationOptions, Purpose, Solution, find};
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
pub(super) struct Ways<'a> {
    world: &'a mut RelitWorld,
    silent: &'a [u32],
    options: &'a CalibrationOptions,
    progress: &'a mut dyn FnMut(f32),
    memory: Memory,
    /// The part that is done.
    reached: f32,
    /// Ways to be tried after this one, at most.
    left: usize,
}

/// The solution that agrees best, of what the compiler may have done.
pub(super) fn best(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> Solution {
    let mut reached = 0.0;
    let mut memory = Memory::default();
    let compilers = compiler::find(world, silent, options, &mut memory, &mut |part| {
        reached = part * COMPILER_PART;
        progress(reached);
    });
    let mut ways = Ways {
        memory,
        reached,
        left: 2 * compilers.len(),
        ..Ways::new(world, silent, options, progress)
    };
    let mut best: Option<(Solution, Compiler)> = None;
    for compiler in compilers {
        let found = ways.with_splashes_or_plain(compiler);
        if (best.as_ref()).is_none_or(|(best, _)| off(&found) < off(best)) {
            best = Some((found, compiler));
        }
    }
    let Some((found, compiler)) = best else {
        return Solution::default();
    };
    if off(&found) <= halved(found.report.before.median_stops) || found.measured_more {
        return found;
    }
    let splashes = found.report.splashes > 0;
    let same = Compiler {
        splashes,
        ..compiler
    };
    let rival = Rival::of(&found);
    let again = ways.measured_more(same, Some(&rival), &Cell::new(splashes), &|| 1.0);
    match again {
        Some(again) if off(&again) < off(&found) => again,
        _ => found,
    }
}

/// What another way has to come up to.
pub(super) struct Rival {
    /// Most error that may be left, stops.
    pub stops: f32,
    /// Most that may be left after each round.
    pub pace: Vec<f32>,
}

impl Rival {
    /// No more than a solution has.
    pub fn of(found: &Solution) -> Rival {
        let after = found.rounds.iter();
        Rival {
            stops: off(found),
            pace: after.map(|left| left * BEHIND).collect(),
        }
    }
}

/// Error that calibration should leave at most, where directives leave this one, stops.
pub(super) fn halved(directives: f32) -> f32 {
    (directives * HALF).max(compiler::NOTHING)
}

/// Error at measurements held out, stops.
fn off(solution: &Solution) -> f32 {
    solution.report.after.median_stops
}

impl<'a> Ways<'a> {
    /// None tried yet, and none planned.
    pub fn new(
        world: &'a mut RelitWorld,
        silent: &'a [u32],
        options: &'a CalibrationOptions,
        progress: &'a mut dyn FnMut(f32),
    ) -> Ways<'a> {
        Ways {
            world,
            silent,
            options,
            progress,
            memory: Memory::default(),
            reached: 0.0,
            left: 0,
        }
    }

    /// What is found with a compiler's back splashes, or without where these are not needed.
    fn with_splashes_or_plain(&mut self, compiler: Compiler) -> Solution {
        self.left = self.left.saturating_sub(2);
        let splashed = self.with(compiler);
        if splashed.report.splashes == 0 {
            return splashed;
        }
        let plain = Compiler {
            splashes: false,
            ..compiler
        };
        splashed_or_plain(splashed, self.with(plain))
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
        let asked = Asked {
            stops: UNEXPLAINED,
            pace: &[],
            splashes: &splashes,
        };
        let first = self.find(compiler, self.options, asked, end);
        first
            .or_else(|| self.measured_more(compiler, None, &splashes, end))
            .unwrap_or_default()
    }

    /// [`with`](Self::with) more measurements. `None` as soon as it is known to agree no better than its rival.
    pub fn measured_more(
        &mut self,
        compiler: Compiler,
        rival: Option<&Rival>,
        splashes: &Cell<bool>,
        end: &dyn Fn() -> f32,
    ) -> Option<Solution> {
        let options = CalibrationOptions {
            samples: self.options.samples * MORE_SAMPLES,
            cache: None,
            ..*self.options
        };
        let asked = Asked {
            stops: rival.map_or(f32::INFINITY, |rival| rival.stops),
            pace: rival.map_or(&[], |rival| &rival.pace[..]),
            splashes,
        };
        let found = self.find(compiler, &options, asked, end)?;
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
        asked: Asked<'_>,
        end: &dyn Fn() -> f32,
    ) -> Option<Solution> {
        compiler.tell(self.world);
        let begin = self.reached;
        let (reached, tell) = (&mut self.reached, &mut self.progress);
        find(
            self.world,
            self.silent,
            options,
            compiler,
            Purpose::Enough(asked),
            &mut self.memory,
            &mut |part| {
                *reached = reached.max(begin + part * (end() - begin));
                tell(*reached);
            },
        )
    }
}

/// What splashes explain, lights that are put in explain as well in many a map, and with fewer.
fn splashed_or_plain(splashed: Solution, plain: Solution) -> Solution {
    let added = |solution: &Solution| solution.report.splashes + solution.report.placed;
    let fewer = added(&splashed) <= added(&plain) && off(&splashed) <= off(&plain);
    if fewer || off(&splashed) < off(&plain) * SPLASHES_KEPT {
        splashed
    } else {
        plain
    }
}
