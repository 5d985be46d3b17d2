//! Calibration: the strengths of a map's lights, and lights that its compiler threw away, from its lightmaps.
//!
//! Compilers strip light entities, and leave their scale factors nowhere; what they computed is still there, as
//! lightmaps. Light is linear in the strengths of lights, so that finding them is a linear problem: *inverse lighting*.
//!
//! 1. `samples`: measurements, spread over the map's area. Some are held out, to judge by. `air`: and the light in the
//!    air, from the light grid.
//! 2. `columns`: shadow rays tell what each known light gives to each sample. Skies that no directive tells the light of
//!    count as known lights of unknown strength (`skies`).
//! 3. `bounce`: which part of the light at samples others throw there, as tracing will.
//! 4. `solve` fits strengths by sparse non-negative least squares of logarithmic error. What directives say is a prior,
//!    and what is the same everywhere is ambient, within limits. `suns` looks for a sun where none is known, `splash`
//!    puts weak lights in front of lamps, as compilers do.
//! 5. `place`: candidates for lost lights all over open space, and where the directions of the light grid meet
//!    (`crossings`), then in front of what stays unexplained, for as long as
//!    that makes light agree better at what is held out. `fit` holds these steps together. `beside`: texels right beside
//!    these lights join the measurements where they are too bright.
//!    Where lights that fall off with the square of the distance leave much, once more with linear ones.
//! 6. `compiler`: all of that with less effort for light that was stored encoded, and for lights that end, to see whether
//!    it explains more. Where the map says that corners were made darker, all of it is done both ways.
//! 7. The world's lights get their strengths, lost lights are added to
//!    [`RelitWorld::point_lights`](crate::RelitWorld::point_lights), light lists are built anew.
//!
//! `docs/calibration.md` has the equations and how well it does. [`residuals()`] tells how well any world's light agrees.
//!
//! Results can be kept ([`CalibrationCache`]): they depend on the world alone, on no clock and no thread.
//!
//! Source: the idea is that of Schoeneman et al., *Painting with Light*, SIGGRAPH 1993.

mod air;
mod apply;
mod beside;
mod bounce;
pub(crate) mod bvh;
pub(crate) mod cache;
mod columns;
mod compiler;
mod crossings;
mod ends;
mod fit;
mod nodes;
pub(crate) mod parallel;
mod place;
pub(crate) mod random;
mod recovery;
mod report;
mod residuals;
mod said;
pub(crate) mod samples;
mod skies;
mod solve;
mod splash;
mod suns;
#[cfg(test)]
mod tests;
mod texels;
mod vertices;
mod views;

pub use beside::{Spots, spots};
pub use cache::CalibrationCache;
pub use recovery::{FOUND_WITHIN, POWER_WITHIN, Recovery, hide_entities, recovery};
pub use report::{Agreement, CalibrationReport};
pub use residuals::{Residual, residuals};
pub use samples::Evidence;

use crate::exposure::Exposure;
use crate::world::RelitWorld;
use bvh::Occluders;
use columns::{Lamp, Source};
use compiler::Compiler;
use fit::Fit;
use glam::Vec3;
use nodes::Measured;
use samples::Taking;
use std::cell::Cell;
use std::collections::HashSet;
use std::time::Instant;

/// Number that changes whenever the same world would give another result.
const VERSION: u32 = 23;

/// One in so many candidates comes from the directions of the light grid.
const CROSSINGS: usize = 5;

/// Part of the time that looking for what the compiler did takes, about.
const COMPILER_PART: f32 = 0.3;

/// Part of the time after which what was planned is tried: more measurements may follow.
const TRIED_PART: f32 = 0.85;

/// Error at measurements held out, stops, that asks for more measurements: light of many small lights takes more to tell.
const UNEXPLAINED: f32 = 0.3;

/// Part of the error of what directives say that asks for more measurements, too, where more of it is left.
const HALF: f32 = 0.5;

/// So many times as many.
const MORE_SAMPLES: usize = 2;

/// How a world is calibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationOptions {
    /// Measurements taken, about.
    pub samples: usize,
    /// Most places tried at a time for lost lights; 0 places none.
    pub candidates: usize,
    /// Seed of the choice of measurements.
    pub seed: u64,
    /// Diffuse bounces that tracing will add.
    pub bounces: u32,
    /// Where results are kept.
    pub cache: Option<CalibrationCache>,
}

impl Default for CalibrationOptions {
    /// What takes a few seconds for a map.
    fn default() -> Self {
        CalibrationOptions {
            samples: 6000,
            candidates: 3000,
            seed: 1,
            bounces: 1,
            cache: None,
        }
    }
}

/// What calibration finds: everything that it changes in a world.
#[derive(Debug, Clone, PartialEq, Default)]
struct Solution {
    /// Strength of each known light source, in the order of [`columns::known`].
    known: Vec<Vec3>,
    /// Lights put in: where and how, intensity.
    placed: Vec<(Lamp, Vec3)>,
    /// Strengths of back splashes, in the order of [`splash::of`].
    splashes: Vec<Vec3>,
    /// Suns put in: direction to it, irradiance.
    suns: Vec<(Vec3, Vec3)>,
    ambient: Vec3,
    /// How bright this light is to be shown: see [`RelitWorld::exposure`].
    exposure: Option<Exposure>,
    report: CalibrationReport,
    /// Agreement at all texels, those that were fitted, too: two fits alike are compared by it with less noise.
    overall: Agreement,
    /// Found with [`MORE_SAMPLES`].
    measured_more: bool,
}

impl Solution {
    /// Number of sources.
    fn lights(&self) -> usize {
        self.known.len() + self.placed.len() + self.splashes.len() + self.suns.len()
    }
}

/// Fits a world's lights to the light that its compiler stored, and puts in lights that the compiler threw away.
///
/// Without lightmaps, vertex colours of lit surfaces tell, then the light grid; without those the world stays as it
/// is. What goes wrong with the cache is a warning of the world's.
pub fn calibrate(world: &mut RelitWorld, options: &CalibrationOptions) -> CalibrationReport {
    calibrate_with(world, options, &mut |_| ())
}

/// [`calibrate`] that tells how far it is: `progress` gets the part that is done, 0 to 1, now and then, on this thread;
/// nothing when the result was kept.
pub fn calibrate_with(
    world: &mut RelitWorld,
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> CalibrationReport {
    let begin = Instant::now();
    let key = options.cache.as_ref().map(|_| cache::key(world, options));
    let silent = skies::silent(world);
    skies::open(world, &silent);
    let kept = match (&options.cache, key) {
        (Some(cache), Some(key)) => cache.read(key, columns::count(world)),
        _ => Ok(None),
    };
    let mut solution = match kept {
        Ok(Some(mut solution)) => {
            solution.report.cached = true;
            solution
        }
        missing => {
            if let Err(problem) = missing {
                world.warnings.push(problem.to_string());
            }
            let solution = best(world, &silent, options, progress);
            progress(1.0);
            if let (Some(cache), Some(key)) = (&options.cache, key)
                && let Err(problem) = cache.write(key, &solution)
            {
                world.warnings.push(problem.to_string());
            }
            solution
        }
    };
    Compiler::of(&solution.report).tell(world);
    world.exposure = solution.exposure;
    if solution.report.evidence == Evidence::Nothing {
        skies::close(world, &silent);
    } else {
        solution.report.splashes = apply::apply(world, &solution);
    }
    solution.report.seconds = begin.elapsed().as_secs_f64();
    world.calibration = Some(solution.report.clone());
    solution.report
}

/// The solution that agrees best, of what the compiler may have done.
fn best(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> Solution {
    let mut reached = 0.0;
    let ways = compiler::find(world, silent, options, &mut |part| {
        reached = part * COMPILER_PART;
        progress(reached);
    });
    let mut left = 2 * ways.len();
    let mut try_way = |world: &mut RelitWorld, way: Compiler| {
        way.tell(world);
        // once more without splashes, unless there are none
        let splashes = Cell::new(way.splashes);
        let begin = reached;
        left -= 1;
        let found = find_with_enough(world, silent, options, way, &splashes, &mut |part| {
            let tries = left + usize::from(!way.splashes || splashes.get());
            reached = reached.max(begin + part * (TRIED_PART - begin) / tries.max(1) as f32);
            progress(reached);
        });
        if way.splashes && !splashes.get() {
            left -= 1;
        }
        found
    };
    let off = |solution: &Solution| solution.report.after.median_stops;
    let mut best: Option<(Solution, Compiler)> = None;
    for way in ways {
        let mut found = try_way(world, way);
        if found.report.splashes > 0 {
            let plain = Compiler {
                splashes: false,
                ..way
            };
            found = splashed_or_plain(found, try_way(world, plain));
        }
        if (best.as_ref()).is_none_or(|(best, _)| off(&found) < off(best)) {
            best = Some((found, way));
        }
    }
    let Some((found, way)) = best else {
        return Solution::default();
    };
    let halved = (found.report.before.median_stops * HALF).max(compiler::NOTHING);
    if off(&found) <= halved || found.measured_more {
        return found;
    }
    let splashes = found.report.splashes > 0;
    let same = Compiler { splashes, ..way };
    same.tell(world);
    let rest = &mut |part| progress(reached + part * (1.0 - reached));
    let again = find_more(world, silent, options, same, &Cell::new(splashes), rest);
    if off(&again) < off(&found) {
        again
    } else {
        found
    }
}

/// What splashes explain, lights that are put in explain as well in many a map, and with fewer.
fn splashed_or_plain(splashed: Solution, plain: Solution) -> Solution {
    let off = |solution: &Solution| solution.report.after.median_stops;
    let added = |solution: &Solution| solution.report.splashes + solution.report.placed;
    let fewer = added(&splashed) <= added(&plain) && off(&splashed) <= off(&plain);
    if fewer || off(&splashed) < off(&plain) * SPLASHES_KEPT {
        splashed
    } else {
        plain
    }
}

/// Part of the error without back splashes that they may leave to be kept, where they are more lights.
const SPLASHES_KEPT: f32 = 0.95;

/// [`find`] with the measurements that it takes.
fn find_with_enough(
    world: &RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    compiler: Compiler,
    splashes: &Cell<bool>,
    progress: &mut dyn FnMut(f32),
) -> Solution {
    let mut reached = 0.0;
    let first = find(
        world,
        silent,
        options,
        compiler,
        Purpose::Enough(UNEXPLAINED, splashes),
        &mut |part| {
            reached = part;
            progress(part);
        },
    );
    if let Some(first) = first {
        return first;
    }
    let rest = &mut |part| progress(reached + part * (1.0 - reached));
    find_more(world, silent, options, compiler, splashes, rest)
}

/// [`find`] with more measurements.
fn find_more(
    world: &RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    compiler: Compiler,
    splashes: &Cell<bool>,
    progress: &mut dyn FnMut(f32),
) -> Solution {
    let options = CalibrationOptions {
        samples: options.samples * MORE_SAMPLES,
        cache: None,
        ..*options
    };
    let last = Purpose::Enough(f32::INFINITY, splashes);
    let found = find(world, silent, &options, compiler, last, progress);
    Solution {
        measured_more: true,
        ..found.unwrap_or_default()
    }
}

/// What a solution is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Purpose<'a> {
    /// To compare one compiler with another: without the light grid and linear falloff.
    Trial,
    /// To be kept if it leaves no more error than so many stops. Told as soon as it is known: whether it has back splashes.
    Enough(f32, &'a Cell<bool>),
}

/// Solves for a world's light. `silent`: skies of which directives tell nothing. `compiler`: what was done to light, which
/// the world knows but for dirt.
///
/// `None` as soon as it is known not to do what it is for.
fn find(
    world: &RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    compiler: Compiler,
    purpose: Purpose<'_>,
    progress: &mut dyn FnMut(f32),
) -> Option<Solution> {
    progress(0.0);
    let thorough = purpose != Purpose::Trial;
    let occluders = samples::occluders(world);
    // Where lights end, black tells little. Trials do not know yet whether they do, and measure alike to be compared.
    let taking = Taking {
        count: options.samples,
        seed: options.seed,
        few_black: !thorough || world.light_end > 0.0,
        dirt: compiler.dirt,
    };
    let (mut samples, evidence) = samples::take(world, &occluders, &taking);
    let texels = samples.len();
    let measured = Measured::new(&samples);
    let mut crossings = Vec::new();
    if thorough && evidence == Evidence::Lightmaps {
        let points = air::points(world, &occluders, |at| measured.holds(at));
        crossings = crossings::find(world, &points, &occluders, options.candidates / CROSSINGS);
        samples.extend(air::more_samples(world, &points, options));
    }
    progress(0.05);
    let mut columns = columns::known(world, &occluders, &samples, silent);
    let known = columns.len();
    let mut solution = Solution {
        known: columns.iter().map(|c| c.strength).collect(),
        ambient: world.ambient,
        report: CalibrationReport {
            evidence,
            samples: texels,
            held_out: samples.iter().filter(|s| s.held_out).count(),
            known,
            gamma: world.stored_gamma,
            ends: world.light_end > 0.0,
            dirty: compiler.dirt.is_some(),
            ..Default::default()
        },
        ..Default::default()
    };
    if samples.is_empty() {
        return Some(solution);
    }
    let unlisted = |material| silent.contains(&material);
    progress(0.15);
    let transfer = bounce::Transfer::new(world, &occluders, &samples, options.bounces, unlisted);
    for column in columns.iter_mut().filter(|c| c.prior.is_none()) {
        column.strength = Vec3::ZERO;
    }
    let mut fit = Fit {
        world,
        occluders: &occluders,
        silent,
        of_triangle: bounce::surfaces_of_triangles(world),
        taking,
        beside: HashSet::new(),
        tried: None,
        splashes: match compiler.splashes {
            true => splash::of(world),
            false => Vec::new(),
        },
        ambient: fit::first_ambient(world, &samples),
        samples,
        measured,
        transfer,
        columns,
        crossings,
        least: world.light_end,
        purpose,
    };
    let first = std::mem::replace(&mut fit.ambient.value, world.ambient);
    fit.rebounce(true);
    solution.report.before = fit.agreement();
    fit.ambient.value = first;
    progress(0.25);
    fit.known();
    progress(0.3);
    let own = splash::columns(world, &occluders, &fit.samples, &fit.splashes, &fit.columns);
    let splashed = fit.splash(own);
    if let Purpose::Enough(_, splashes) = purpose {
        splashes.set(splashed);
    }
    progress(0.35);
    if options.candidates > 0 {
        let start = fit.start();
        let part_of = if thorough { 0.4 } else { 0.55 };
        let hopeless = fit.place(options.candidates, false, &mut |part| {
            progress(0.35 + part_of * part);
        });
        if hopeless {
            return None;
        }
        if thorough {
            fit.place_linear(start, options.candidates);
        }
    } else {
        fit.settle();
    }
    progress(0.9);
    if thorough && options.candidates > 0 {
        fit.with_or_without_air();
    }
    fit.more_ambient();
    progress(1.0);
    solution.report.after = fit.agreement();
    solution.overall = fit.agreement_overall();
    solution.exposure = fit.exposure();
    let (columns, splashes) = (fit.columns, fit.splashes);
    solution.splashes = vec![Vec3::ZERO; splashes.len()];
    solution.known = columns.iter().take(known).map(|c| c.strength).collect();
    for column in columns.iter().skip(known) {
        match column.source {
            Source::Placed(lamp) => solution.placed.push((lamp, column.strength)),
            Source::FoundSun(direction) if column.strength != Vec3::ZERO => {
                solution.suns.push((direction, column.strength));
            }
            Source::Splash(index) => {
                if let Some(strength) = solution.splashes.get_mut(index as usize) {
                    *strength = column.strength;
                }
            }
            _ => {}
        }
    }
    solution.report.placed = solution.placed.len();
    solution.report.splashes = (splashes.iter().zip(&solution.splashes))
        .filter(|(_, strength)| strength.max_element() > 0.0)
        .map(|(splash, _)| splash.points.len())
        .sum();
    solution.report.suns = solution.suns.len();
    solution.ambient = fit.ambient.value;
    Some(solution)
}
