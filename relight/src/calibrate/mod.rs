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
//!    (`crossings`), then in front of what stays unexplained (`fronts`), for as long as
//!    that makes light agree better at what is held out. `fit` holds these steps together. `beside`: texels right beside
//!    these lights join the measurements where they are too bright.
//!    Where that leaves much, once more with lights that may fall off linearly, too.
//! 6. `compiler`: all of that with less effort for light that was stored encoded, and for lights that end, to see whether
//!    it explains more. `ways`: where the map says that corners were made darker, all of it is done both ways; with back
//!    splashes and without; with more measurements where much is left. `memory`: what these have in common is traced once.
//! 7. The world's lights get their strengths, lost lights are added to
//!    [`RelitWorld::point_lights`](crate::RelitWorld::point_lights), light lists are built anew.
//! 8. `styles`: the same for the light of each style, which the compiler stored apart.
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
mod cache;
mod columns;
mod compiler;
mod crossings;
mod ends;
mod fit;
mod fronts;
mod memory;
mod nodes;
mod place;
mod recovery;
mod report;
mod residuals;
mod said;
mod samples;
mod skies;
mod solve;
mod splash;
mod spread;
mod styles;
mod suns;
#[cfg(test)]
mod tests;
mod texels;
mod vertices;
mod views;
mod ways;

pub use crate::emitters::{Agreement, CalibrationReport, Evidence};
pub use beside::{Spots, spots};
pub use recovery::{FOUND_WITHIN, POWER_WITHIN, Recovery, hide_entities, recovery};
pub use residuals::{Residual, residuals};

use crate::cache::CalibrationCache;
use crate::exposure::Exposure;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use columns::{Lamp, Source};
use compiler::Compiler;
use fit::Fit;
use fronts::Fronts;
use glam::Vec3;
use memory::{Looked, Memory};
use nodes::Measured;
use samples::Taking;
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::time::Instant;

/// Number that changes whenever the same world would give another result.
const VERSION: u32 = 27;

/// One in so many candidates comes from the directions of the light grid.
const CROSSINGS: usize = 5;

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
    /// Found with more measurements than asked for.
    measured_more: bool,
    /// Error at measurements held out after each round of points, stops.
    rounds: Vec<f32>,
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
        (Some(cache), Some(key)) => cache::read(cache, key, columns::count(world)),
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
            let solution = ways::best(world, &silent, options, progress);
            progress(1.0);
            if let (Some(cache), Some(key)) = (&options.cache, key)
                && let Err(problem) = cache::write(cache, key, &solution)
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
    world.calibration = Some(solution.report.clone());
    styles::add(world, options);
    solution.report.seconds = begin.elapsed().as_secs_f64();
    world.calibration = Some(solution.report.clone());
    solution.report
}

/// What a solution is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Purpose<'a> {
    /// To compare one compiler with another: without the light grid and linear falloff. Lights are looked for so many times
    /// at most.
    Trial(usize),
    /// To be kept if it agrees well enough.
    Enough(Asked<'a>),
}

/// When a solution is good enough to be kept.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Asked<'a> {
    /// Most error that is left at measurements held out, stops.
    stops: f32,
    /// What may be left after each round: another way that has more is given up.
    pace: &'a [f32],
    /// Told as soon as it is known: whether there are back splashes.
    splashes: &'a Cell<bool>,
}

/// Solves for a world's light. `silent`: skies of which directives tell nothing. `compiler`: what was done to light, which
/// the world knows but for dirt. `memory`: what was traced for the same world before.
///
/// `None` as soon as it is known not to do what it is for.
fn find(
    world: &RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    compiler: Compiler,
    purpose: Purpose<'_>,
    memory: &mut Memory,
    progress: &mut dyn FnMut(f32),
) -> Option<Solution> {
    progress(0.0);
    let thorough = !matches!(purpose, Purpose::Trial(_));
    let occluders = Occluders::of_world(world);
    // Where lights end, black tells little. Trials do not know yet whether they do, and measure alike to be compared.
    let taking = Taking {
        count: options.samples,
        seed: options.seed,
        few_black: !thorough || world.light_end > 0.0,
        dirt: compiler.dirt,
    };
    let (mut samples, evidence) = memory.take(world, &occluders, &taking);
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
    let looked = Looked::of(world, &samples, &crossings, options.candidates);
    let transfer = memory.transfer(world, &occluders, &samples, options.bounces, unlisted);
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
        looked_at: HashMap::new(),
        tried: memory.tried(&looked),
        fronts: Fronts::new(samples.len()),
        rounds: Vec::new(),
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
    if let Purpose::Enough(asked) = purpose {
        asked.splashes.set(splashed);
    }
    progress(0.35);
    if options.candidates > 0 {
        let start = fit.start();
        let part_of = if thorough { 0.4 } else { 0.55 };
        let hopeless = fit.place(options.candidates, false, &mut |part| {
            progress(0.35 + part_of * part);
        });
        memory.keep_tried(looked, fit.tried.clone());
        if hopeless {
            return None;
        }
        if thorough {
            let directives = solution.report.before.median_stops;
            fit.place_linear(start, options.candidates, directives);
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
    if thorough {
        solution.exposure = fit.exposure();
    }
    solution.rounds = std::mem::take(&mut fit.rounds);
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
