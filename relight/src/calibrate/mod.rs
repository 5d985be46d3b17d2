//! Calibration: fits the powers of a map's lights to its lightmaps and places the lights that its compiler
//! stripped.
//!
//! Compilers strip light entities and do not record their scale factors, but the lightmaps hold the result of both.
//! Irradiance is linear in the powers of the lights, so finding the powers is a linear problem (*inverse
//! lighting*).
//!
//! 1. `samples` takes measurements, stratified by area: `texels` of lightmaps, `vertices` of surfaces lit by
//!    vertex. One in five is held out and states the error. `light_grid` adds the map's light grid.
//! 2. `columns` traces shadow rays: the irradiance that each known light of strength 1 gives to each sample.
//!    `skies` adds skies that no directive describes, as lights of unknown strength.
//! 3. `bounce` traces the transfer matrix: the part of a sample's light that other surfaces reflect onto it, as the
//!    tracer will compute it.
//! 4. `solve` fits the strengths by sparse non-negative least squares of the logarithmic error. Directives act as a
//!    prior; a bounded ambient term is fitted with the lights. `suns` searches for a sun where no directive gives
//!    one, `splash` adds the compiler's back splashes.
//! 5. `placement` searches for stripped lights. Candidates are the nodes of a grid over open space
//!    (`candidate_grid`), the points where directions of the light grid meet (`triangulation`), and points in front
//!    of samples with a large residual (`residual_candidates`). Rounds continue while the held-out error falls.
//!    `near_light` adds texels beside placed lights that the fit makes too bright. If a large error is left, the
//!    search is repeated with linear falloff allowed. `fit` runs these steps.
//! 6. `compiler` decides what the compiler did to light: gamma, light cutoff, dirt. It reads the command line
//!    stored in the map (`compiler_command_line`) or fits with fewer samples for each possibility. `hypotheses`
//!    fits the remaining combinations to completion and keeps the best. `trace_cache` shares rays between fits.
//! 7. `apply` sets the fitted strengths, appends the placed lights to
//!    [`RelitWorld::point_lights`](crate::RelitWorld::point_lights) and rebuilds the light lists.
//! 8. `styles` repeats the fit for each light style, which the compiler stored separately.
//!
//! `docs/src/how/calibration.md` explains the equations, `lab/notes/calibration.md` has the measured errors.
//! [`residuals()`] compares any world's light with its stored light.
//!
//! A result depends on the world and the options alone, on no clock and no thread count, so it can be cached
//! ([`CalibrationCache`]).
//!
//! Source: Schoeneman et al., *Painting with Light*, SIGGRAPH 1993, for inverse lighting.

mod apply;
mod bounce;
mod candidate_grid;
mod columns;
mod compiler;
mod compiler_command_line;
mod cutoff;
mod dirt;
mod fit;
mod hypotheses;
mod light_grid;
mod near_light;
mod placement;
mod recovery;
mod report;
mod residual_candidates;
mod residuals;
mod result_cache;
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
pub(crate) mod triangle_lights;
mod triangulation;
mod vertices;

pub use crate::emitters::{Agreement, CalibrationReport, Evidence};
pub(crate) use compiler_command_line::dirt_of_calibrated;
pub use dirt::{Dirt, Surroundings};
pub use near_light::{Spots, spots};
pub use recovery::{FOUND_WITHIN, POWER_WITHIN, Recovery, hide_entities, recovery};
pub use residuals::{Residual, residuals};

use crate::cache::CalibrationCache;
use crate::exposure::Exposure;
use crate::world::RelitWorld;
use candidate_grid::MeasuredSpace;
use columns::{Lamp, Source};
use compiler::Compiler;
use fit::Fit;
use glam::Vec3;
use residual_candidates::ResidualCandidates;
use samples::SamplingOptions;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::time::Instant;
use trace_cache::{CandidateKey, TraceCache};

/// Version of the results; to be incremented when the same world gives another result, or [`Solution`] changes.
const VERSION: u32 = 28;

/// Light-grid candidates: at most one for this many grid nodes.
const CROSSINGS: usize = 5;

/// Settings of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationOptions {
    /// Approximate number of samples.
    pub samples: usize,
    /// Largest number of candidate positions in a round; 0 places no lights.
    pub candidates: usize,
    /// Seed of the choice of samples.
    pub seed: u64,
    /// Diffuse bounces that the tracer computes.
    pub bounces: u32,
    /// Cache of results; `None` computes anew.
    pub cache: Option<CalibrationCache>,
}

impl Default for CalibrationOptions {
    /// Settings that take a few seconds a map.
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

/// Result of a calibration: everything that it changes in a world.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Solution {
    /// Strength of each known source, in the order of [`columns::known`].
    known: Vec<Vec3>,
    /// Placed lights: position and falloff, radiant intensity.
    placed: Vec<(Lamp, Vec3)>,
    /// Strength of the back splashes of each material, in the order of [`splash::of`].
    splashes: Vec<Vec3>,
    /// Suns found: unit vector towards the sun, irradiance.
    suns: Vec<(Vec3, Vec3)>,
    ambient: Vec3,
    /// Exposure for this light: see [`RelitWorld::exposure`].
    exposure: Option<Exposure>,
    report: CalibrationReport,
    /// Error at all texels, fitted ones included: less noise for a comparison of fits with equal freedom.
    #[serde(skip)]
    overall: Agreement,
    /// Whether it was fitted to more samples than the options ask for.
    #[serde(skip)]
    measured_more: bool,
    /// Error at held-out samples after each round of placement, stops.
    #[serde(skip)]
    rounds: Vec<f32>,
}

/// Fits a world's lights to the light that its compiler stored, and places the lights that the compiler stripped.
///
/// The samples are lightmap texels, else vertex colours of lit surfaces, else points of the light grid; a world
/// without any of these stays unchanged. Cache failures become warnings of the world.
pub fn calibrate(world: &mut RelitWorld, options: &CalibrationOptions) -> CalibrationReport {
    calibrate_with(world, options, &mut |_| ())
}

/// [`calibrate`] with progress reports: `progress` gets the completed part, 0 to 1, on the calling thread. It is
/// not called when the result comes from the cache.
pub fn calibrate_with(
    world: &mut RelitWorld,
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> CalibrationReport {
    let begin = Instant::now();
    let key = (options.cache.is_some()).then(|| result_cache::key(world, options));
    let unknown_skies = skies::unknown_skies(world);
    skies::open(world, &unknown_skies);
    let kept = match (&options.cache, key) {
        (Some(cache), Some(key)) => result_cache::read(cache, key, columns::count(world)),
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
                && let Err(problem) = result_cache::write(cache, key, &solution)
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

/// What a fit is for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum FitMode<'a> {
    /// Comparison of compiler settings: no light grid, no linear falloff, at most this many rounds of placement.
    Trial(usize),
    /// Complete fit, abandoned when it cannot reach this error.
    Full(Acceptance<'a>),
}

/// Error that a complete fit must reach.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Acceptance<'a> {
    /// Largest error at held-out samples, stops.
    stops: f32,
    /// Largest error after each round, stops; above it the fit is abandoned.
    round_limits: &'a [f32],
    /// Output: whether the fit uses back splashes; set as soon as it is decided.
    splashes: &'a Cell<bool>,
}

/// Fits a world's light. `unknown_skies`: materials of skies without directives. `compiler`: what the compiler did
/// to light; the world has all of it but dirt. `traced`: rays of earlier fits of the same world.
///
/// `None` when the fit was abandoned.
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
    let occluders = traced.occluders(world);
    let occluders = &*occluders;
    // With a light cutoff a black texel is weak evidence. Trials with and without a cutoff must use the same
    // samples.
    let sampling = SamplingOptions {
        count: options.samples,
        seed: options.seed,
        few_black: !thorough || world.light_cutoff > 0.0,
        dirt: compiler.dirt,
    };
    let (mut samples, evidence) = traced.take(world, occluders, &sampling);
    let texels = samples.len();
    let measured = MeasuredSpace::new(&samples);
    let mut crossings = Vec::new();
    if thorough && evidence == Evidence::Lightmaps {
        let points = light_grid::points(world, occluders, |at| measured.holds(at));
        crossings = triangulation::find(world, &points, occluders, options.candidates / CROSSINGS);
        samples.extend(light_grid::additional_samples(world, &points, options));
    }
    progress(0.05);
    let mut columns = columns::known(world, occluders, &samples, unknown_skies);
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
    let transfer = traced.transfer(world, occluders, &samples, options.bounces, unlisted);
    for column in columns.iter_mut().filter(|c| c.prior.is_none()) {
        column.strength = Vec3::ZERO;
    }
    let mut fit = Fit {
        world,
        occluders,
        unknown_skies,
        of_triangle: world.surfaces_of_triangles(),
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
    let own = splash::columns(world, occluders, &fit.samples, &fit.splashes, &fit.columns);
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
