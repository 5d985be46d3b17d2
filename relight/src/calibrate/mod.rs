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
//!    (`crossings`), then in front of what stays unexplained (`residual_candidates`), for as long as
//!    that makes light agree better at what is held out. `fit` holds these steps together. `near_light`: texels right beside
//!    these lights join the measurements where they are too bright.
//!    Where that leaves much, once more with lights that may fall off linearly, too.
//! 6. `compiler`: all of that with less effort for light that was stored encoded, and for lights that end, to see whether
//!    it explains more. `hypotheses`: where the map says that corners were made darker, all of it is done both ways; with back
//!    splashes and without; with more measurements where much is left. `traced`: what these have in common is traced once.
//! 7. The world's lights get their strengths, lost lights are added to
//!    [`RelitWorld::point_lights`](crate::RelitWorld::point_lights), light lists are built anew.
//! 8. `styles`: the same for the light of each style, which the compiler stored apart.
//!
//! `docs/calibration.md` has the equations and how well it does. [`residuals()`] tells how well any world's light agrees.
//!
//! Results can be kept ([`CalibrationCache`]): they depend on the world alone, on no clock and no thread.
//!
//! Source: the idea is that of Schoeneman et al., *Painting with Light*, SIGGRAPH 1993.

mod apply;
mod bounce;
mod cache;
mod candidate_grid;
mod columns;
mod compiler;
mod compiler_command_line;
mod cutoff;
mod fit;
mod hypotheses;
mod light_grid;
mod near_light;
mod placement;
mod recovery;
mod report;
mod residual_candidates;
mod residuals;
mod sample_soa;
mod samples;
mod skies;
mod solve;
mod spawn_views;
mod splash;
mod styles;
mod suns;
#[cfg(test)]
mod tests;
mod texels;
mod trace_cache;
mod triangulation;
mod vertices;

pub use crate::emitters::{Agreement, CalibrationReport, Evidence};
pub use near_light::{Spots, spots};
pub use recovery::{FOUND_WITHIN, POWER_WITHIN, Recovery, hide_entities, recovery};
pub use residuals::{Residual, residuals};

use crate::cache::CalibrationCache;
use crate::exposure::Exposure;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use candidate_grid::MeasuredSpace;
use columns::{Lamp, Source};
use compiler::Compiler;
use fit::Fit;
use glam::Vec3;
use residual_candidates::ResidualCandidates;
use samples::SamplingOptions;
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::time::Instant;
use trace_cache::{CandidateKey, TraceCache};

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
    let unknown_skies = skies::unknown_skies(world);
    skies::open(world, &unknown_skies);
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
            let solution = hypotheses::best(world, &unknown_skies, options, progress);
            progress(1.0);
            if let (Some(cache), Some(key)) = (&options.cache, key)
                && let Err(problem) = cache::write(cache, key, &solution)
            {
                world.warnings.push(problem.to_string());
            }
            solution
        }
    };
    Compiler::of(&solution.report).apply_to(world);
    world.exposure = solution.exposure;
    if solution.report.evidence == Evidence::Nothing {
        skies::close(world, &unknown_skies);
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
enum FitMode<'a> {
    /// To compare one compiler with another: without the light grid and linear falloff. Lights are looked for so many times
    /// at most.
    Trial(usize),
    /// To be kept if it agrees well enough.
    Full(Acceptance<'a>),
}

/// When a solution is good enough to be kept.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Acceptance<'a> {
    /// Most error that is left at measurements held out, stops.
    stops: f32,
    /// What may be left after each round: another way that has more is given up.
    round_limits: &'a [f32],
    /// Told as soon as it is known: whether there are back splashes.
    splashes: &'a Cell<bool>,
}

/// Solves for a world's light. `unknown_skies`: skies of which directives tell nothing. `compiler`: what was done to light, which
/// the world knows but for dirt. `traced`: what was traced for the same world before.
///
/// `None` as soon as it is known not to do what it is for.
fn find(
    world: &RelitWorld,
    unknown_skies: &[u32],
    options: &CalibrationOptions,
    compiler: Compiler,
    mode: FitMode<'_>,
    traced: &mut TraceCache,
    progress: &mut dyn FnMut(f32),
) -> Option<Solution> {
    progress(0.0);
    let thorough = !matches!(mode, FitMode::Trial(_));
    let occluders = Occluders::of_world(world);
    // Where lights end, black tells little. Trials do not know yet whether they do, and measure alike to be compared.
    let sampling = SamplingOptions {
        count: options.samples,
        seed: options.seed,
        few_black: !thorough || world.light_cutoff > 0.0,
        dirt: compiler.dirt,
    };
    let (mut samples, evidence) = traced.take(world, &occluders, &sampling);
    let texels = samples.len();
    let measured = MeasuredSpace::new(&samples);
    let mut crossings = Vec::new();
    if thorough && evidence == Evidence::Lightmaps {
        let points = light_grid::points(world, &occluders, |at| measured.holds(at));
        crossings = triangulation::find(world, &points, &occluders, options.candidates / CROSSINGS);
        samples.extend(light_grid::additional_samples(world, &points, options));
    }
    progress(0.05);
    let mut columns = columns::known(world, &occluders, &samples, unknown_skies);
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
            has_cutoff: world.light_cutoff > 0.0,
            dirty: compiler.dirt.is_some(),
            ..Default::default()
        },
        ..Default::default()
    };
    if samples.is_empty() {
        return Some(solution);
    }
    let unlisted = |material| unknown_skies.contains(&material);
    progress(0.15);
    let candidate_key = CandidateKey::of(world, &samples, &crossings, options.candidates);
    let transfer = traced.transfer(world, &occluders, &samples, options.bounces, unlisted);
    for column in columns.iter_mut().filter(|c| c.prior.is_none()) {
        column.strength = Vec3::ZERO;
    }
    let mut fit = Fit {
        world,
        occluders: &occluders,
        unknown_skies,
        of_triangle: bounce::surfaces_of_triangles(world),
        sampling,
        near_light_texels: HashSet::new(),
        near_light_measurements: HashMap::new(),
        grid_candidates: traced.candidates(&candidate_key),
        residual_candidates: ResidualCandidates::new(samples.len()),
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
        cutoff: world.light_cutoff,
        mode,
    };
    let first = std::mem::replace(&mut fit.ambient.value, world.ambient);
    fit.rebounce(true);
    solution.report.before = fit.agreement();
    fit.ambient.value = first;
    progress(0.25);
    fit.fit_known();
    progress(0.3);
    let own = splash::columns(world, &occluders, &fit.samples, &fit.splashes, &fit.columns);
    let splashed = fit.try_splashes(own);
    if let FitMode::Full(acceptance) = mode {
        acceptance.splashes.set(splashed);
    }
    progress(0.35);
    if options.candidates > 0 {
        let state_before = fit.state();
        let part_of = if thorough { 0.4 } else { 0.55 };
        let abandoned = fit.place_lights(options.candidates, false, &mut |part| {
            progress(0.35 + part_of * part);
        });
        traced.keep_candidates(candidate_key, fit.grid_candidates.clone());
        if abandoned {
            return None;
        }
        if thorough {
            let directives = solution.report.before.median_stops;
            fit.try_linear_falloff(state_before, options.candidates, directives);
        }
    } else {
        fit.settle();
    }
    progress(0.9);
    if thorough && options.candidates > 0 {
        fit.drop_light_grid_if_worse();
    }
    fit.raise_ambient();
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
