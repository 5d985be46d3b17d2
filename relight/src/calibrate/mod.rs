//! Calibration: the strengths of a map's lights, and lights that its compiler threw away, from its lightmaps.
//!
//! Compilers strip light entities, and leave their scale factors nowhere; what they computed is still there, as
//! lightmaps. Light is linear in the strengths of lights, so that finding them is a linear problem: *inverse lighting*.
//!
//! 1. `samples`: measurements, spread over the map's area. Some are held out, to judge by.
//! 2. `bounce`: the part of each that other surfaces throw there, which tracing will add.
//! 3. `columns`: shadow rays tell what each known light gives to each sample.
//! 4. `place`: candidates for lost lights all over open space, then in front of what stays unexplained;
//!    `solve` chooses among them by sparse non-negative least squares of logarithmic error. What directives say
//!    is a prior, and what is the same everywhere is ambient, within limits.
//! 5. The world's lights get their strengths, lost lights are added to
//!    [`RelitWorld::point_lights`](crate::RelitWorld::point_lights), light lists are built anew.
//!
//! Results can be kept ([`CalibrationCache`]): they depend on the world alone, on no clock and no thread.
//!
//! Source: the idea is that of Schoeneman et al., *Painting with Light*, SIGGRAPH 1993.

mod apply;
mod bounce;
pub(crate) mod bvh;
pub(crate) mod cache;
mod columns;
pub(crate) mod parallel;
mod place;
pub(crate) mod random;
mod report;
pub(crate) mod samples;
mod skies;
mod solve;
mod suns;
#[cfg(test)]
mod tests;

pub use cache::CalibrationCache;
pub use report::{Agreement, CalibrationReport};
pub use samples::Evidence;

use crate::world::RelitWorld;
use columns::Source;
use glam::Vec3;
use samples::Sample;
use solve::Ambient;
use std::time::Instant;

/// Number that changes whenever the same world would give another result.
const VERSION: u32 = 4;

/// Most times that lights are looked for.
const ROUNDS: u32 = 4;

/// Lights are looked for again while that leaves less than this part of the error at samples held out.
const ENOUGH: f32 = 0.985;

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
    /// Lights put in: origin, intensity.
    placed: Vec<(Vec3, Vec3)>,
    /// Suns put in: direction to it, irradiance.
    suns: Vec<(Vec3, Vec3)>,
    ambient: Vec3,
    report: CalibrationReport,
}

impl Solution {
    /// Number of sources.
    fn lights(&self) -> usize {
        self.known.len() + self.placed.len() + self.suns.len()
    }
}

/// Fits a world's lights to the light that its compiler stored, and puts in lights that the compiler threw away.
///
/// Without lightmaps, vertex colours of lit surfaces tell, then the light grid; without those the world stays as it
/// is. What goes wrong with the cache is a warning of the world's.
pub fn calibrate(world: &mut RelitWorld, options: &CalibrationOptions) -> CalibrationReport {
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
            let solution = find(world, &silent, options);
            if let (Some(cache), Some(key)) = (&options.cache, key)
                && let Err(problem) = cache.write(key, &solution)
            {
                world.warnings.push(problem.to_string());
            }
            solution
        }
    };
    if solution.report.evidence == Evidence::Nothing {
        skies::close(world, &silent);
    } else {
        apply::apply(world, &solution);
    }
    solution.report.seconds = begin.elapsed().as_secs_f64();
    world.calibration = Some(solution.report.clone());
    solution.report
}

/// Solves for a world's light. `silent`: skies of which directives tell nothing.
fn find(world: &RelitWorld, silent: &[u32], options: &CalibrationOptions) -> Solution {
    let occluders = samples::occluders(world);
    let (mut samples, evidence) = samples::take(world, &occluders, options.samples, options.seed);
    let mut columns = columns::known(world, &occluders, &samples, silent);
    let known = columns.len();
    let mut solution = Solution {
        known: columns.iter().map(|c| c.strength).collect(),
        ambient: world.ambient,
        report: CalibrationReport {
            evidence,
            samples: samples.len(),
            held_out: samples.iter().filter(|s| s.held_out).count(),
            known,
            ..Default::default()
        },
        ..Default::default()
    };
    if samples.is_empty() {
        return solution;
    }
    let unlisted = |material| silent.contains(&material);
    let transfer = bounce::Transfer::new(world, &occluders, &samples, options.bounces, unlisted);
    for column in columns.iter_mut().filter(|c| c.prior.is_none()) {
        column.strength = Vec3::ZERO;
    }
    let direct = solve::direct(&samples, &columns);
    rebounce(&mut samples, transfer.of(&direct, true));
    let before = solve::predict(&samples, &columns, world.ambient);
    solution.report.before = Agreement::of(&samples, &before);

    // What was measured is a better first guess of what is thrown back than what is believed of lights.
    let measured: Vec<Vec3> = samples.iter().map(|s| s.value).collect();
    rebounce(&mut samples, transfer.of(&measured, false));
    let mut ambient = first_ambient(world, &samples);
    let effort = solve::Effort {
        rounds: 8,
        sweeps: 12,
        sparsity: 0.0,
        anew: true,
    };
    solve::solve(&samples, &mut columns, &mut ambient, effort);
    if occluders.any_sky() {
        suns::find(&occluders, &samples, &mut columns, &mut ambient, effort);
    }
    let fixed = columns.len();
    if options.candidates > 0 {
        let (mut spacing, mut best) = (0.0, f32::INFINITY);
        for round in 0..ROUNDS {
            let kept = (columns.clone(), ambient);
            let scene = place::Scene {
                world,
                occluders: &occluders,
                samples: &samples,
                candidates: options.candidates,
            };
            if round == 0 {
                spacing = place::over_space(&scene, &mut columns, fixed, &mut ambient);
            } else {
                place::in_front(&scene, &mut columns, fixed, &mut ambient, spacing);
            }
            settle(&mut samples, &mut columns, &mut ambient, &transfer);
            let found = held_out_error(&samples, &columns, ambient.value);
            if found > best * ENOUGH {
                if found > best {
                    (columns, ambient) = kept;
                    settle(&mut samples, &mut columns, &mut ambient, &transfer);
                }
                break;
            }
            best = found;
        }
    } else {
        settle(&mut samples, &mut columns, &mut ambient, &transfer);
    }
    let after = solve::predict(&samples, &columns, ambient.value);
    solution.report.after = Agreement::of(&samples, &after);
    solution.known = columns.iter().take(known).map(|c| c.strength).collect();
    for column in columns.iter().skip(known) {
        match column.source {
            Source::Placed(origin) => solution.placed.push((origin, column.strength)),
            Source::FoundSun(direction) if column.strength != Vec3::ZERO => {
                solution.suns.push((direction, column.strength));
            }
            _ => {}
        }
    }
    solution.report.placed = solution.placed.len();
    solution.report.suns = solution.suns.len();
    solution.ambient = ambient.value;
    solution
}

/// Fits strengths and the light that they throw back to each other, in turns.
fn settle(
    samples: &mut [Sample],
    columns: &mut [columns::Column],
    ambient: &mut Ambient,
    transfer: &bounce::Transfer,
) {
    let effort = solve::Effort {
        rounds: 3,
        sweeps: 8,
        sparsity: 0.0,
        anew: false,
    };
    for _ in 0..3 {
        let direct = solve::direct(samples, columns);
        rebounce(samples, transfer.of(&direct, false));
        solve::solve(samples, columns, ambient, effort);
    }
    let direct = solve::direct(samples, columns);
    rebounce(samples, transfer.of(&direct, false));
}

fn rebounce(samples: &mut [Sample], bounced: Vec<Vec3>) {
    for (sample, bounce) in samples.iter_mut().zip(bounced) {
        sample.bounce = bounce;
    }
}

/// Median error of what fitting does not see.
fn held_out_error(samples: &[Sample], columns: &[columns::Column], ambient: Vec3) -> f32 {
    Agreement::of(samples, &solve::predict(samples, columns, ambient)).median_stops
}

/// Where the ambient term starts, and how far it may go: what darker places have. More would hide lights.
fn first_ambient(world: &RelitWorld, samples: &[Sample]) -> Ambient {
    let channel = |k: usize| {
        let mut values: Vec<f32> = samples
            .iter()
            .filter(|s| !s.held_out)
            .map(|s| s.value[k])
            .collect();
        values.sort_by(f32::total_cmp);
        values.get(values.len() / 5).copied().unwrap_or(0.0)
    };
    let dark = Vec3::new(channel(0), channel(1), channel(2));
    // Without any light, loading took the mean of all light for ambient.
    let start = if world.light_count() == 0 {
        Vec3::ZERO
    } else {
        world.ambient.min(dark)
    };
    Ambient {
        value: start,
        limit: dark,
    }
}
