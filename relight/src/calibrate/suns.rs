//! Search for a sun without a directive.
//!
//! A sun leaves a unique pattern: the cosine to one direction wherever a ray in that direction reaches the sky, and
//! nothing in shadow. Directions over the upper hemisphere are tried against the residual of the known lights, and the
//! best one is refined.

use super::columns::{Column, Source, sun_rows};
use super::samples::Sample;
use super::solve::{Ambient, Effort, Residual, norm, residual, solve};
use crate::occluders::Occluders;
use glam::Vec3;
use std::f32::consts::TAU;
use support::parallel;
use support::slice;

/// Directions tried first, evenly over the upper hemisphere.
const DIRECTIONS: u32 = 320;

/// Samples by which directions are compared.
const SUBSET: usize = 1600;

/// Squared logarithmic error that a sun must remove for each fitted sample.
const WORTH: f32 = 0.004;

/// Smallest elevation of a sun, sine.
const LOWEST: f32 = 0.03;

/// Step sizes of the refinement, radians.
const TURNS: [f32; 5] = [0.07, 0.035, 0.018, 0.009, 0.0045];

/// Adds a sun to `columns` if none shines and it removes enough error. At most one is added: each sun costs the
/// tracer a ray, and the residual beside a sun is seldom another sun.
pub(super) fn find(
    occluders: &Occluders,
    samples: &[Sample],
    columns: &mut Vec<Column>,
    ambient: &mut Ambient,
    effort: Effort,
    cutoff: f32,
) {
    let worthwhile = WORTH * samples.iter().filter(|s| !s.held_out).count() as f32;
    let state = residual(samples, columns, ambient.value);
    let shines = |c: &&Column| matches!(c.source, Source::Sun(_)) && worth(c, &state) >= worthwhile;
    if columns.iter().any(|c| shines(&c)) {
        return;
    }
    let subset = fitted_subset(samples);
    let Some(first) = best_direction(occluders, samples, &subset, &state) else {
        return; // no sun reduces the error
    };
    let mut direction = refine(occluders, samples, &subset, &state, first);
    let known = columns.len();
    // Refitting the other sources improves the residual for the direction.
    for turns in [2, 1, 0] {
        columns.truncate(known);
        columns.push(Column {
            source: Source::FoundSun(direction),
            rows: sun_rows(occluders, samples, direction),
            pieces: Vec::new(),
            strength: Vec3::ZERO,
            limit: Vec3::INFINITY,
            prior: None,
        });
        let mut state = solve(samples, columns, ambient, effort, cutoff);
        let Some(sun) = slice::get(columns, known) else {
            return;
        };
        if worth(sun, &state) < worthwhile {
            columns.truncate(known);
            solve(samples, columns, ambient, effort, cutoff);
            return;
        }
        if turns == 0 {
            return;
        }
        for &(i, a) in &sun.rows {
            if let Some(rest) = state.rest.get_mut(i as usize) {
                *rest += sun.strength * a;
            }
        }
        direction = refine(occluders, samples, &subset, &state, direction);
    }
}

/// Squared error that a source removes.
fn worth(column: &Column, state: &Residual) -> f32 {
    norm(column, &state.weights) * column.strength.length_squared() / 3.0
}

/// Fitted samples, evenly thinned.
fn fitted_subset(samples: &[Sample]) -> Vec<u32> {
    let all: Vec<u32> = (0u32..)
        .zip(samples)
        .filter(|(_, s)| !s.held_out)
        .map(|(i, _)| i)
        .collect();
    let count = all.len().min(SUBSET);
    (0..count)
        .filter_map(|k| all.get(k * all.len() / count.max(1)).copied())
        .collect()
}

/// Error that a sun of the best strength removes at the samples of a subset.
fn explained_error(
    occluders: &Occluders,
    samples: &[Sample],
    subset: &[u32],
    state: &Residual,
    direction: Vec3,
) -> f32 {
    let mut gradient = Vec3::ZERO;
    let mut norm = 0.0;
    for &i in subset {
        let at = i as usize;
        let (Some(sample), Some(rest), Some(&weight)) = (
            slice::get(samples, at),
            slice::get(&state.rest, at),
            slice::get(&state.weights, at),
        ) else {
            continue;
        };
        if weight <= 0.0 {
            continue;
        }
        if let Some(a) = super::columns::sun_at(occluders, sample, direction) {
            gradient += *rest * (weight * a);
            norm += weight * a * a;
        }
    }
    if norm > 0.0 {
        gradient.max(Vec3::ZERO).length_squared() / norm
    } else {
        0.0
    }
}

/// The best of evenly distributed directions of the upper hemisphere; `None` if none removes error.
fn best_direction(
    occluders: &Occluders,
    samples: &[Sample],
    subset: &[u32],
    state: &Residual,
) -> Option<Vec3> {
    // A Fibonacci spiral with equal steps of height distributes points evenly over the sphere.
    let golden = (5.0f32.sqrt() - 1.0) / 2.0;
    let directions: Vec<Vec3> = (0..DIRECTIONS)
        .map(|i| {
            let z = (i as f32 + 0.5) / DIRECTIONS as f32;
            let (sin, cos) = ((i as f32 * golden).fract() * TAU).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            Vec3::new(radius * cos, radius * sin, z)
        })
        .collect();
    let explained = parallel::map(&directions, |_, &d| {
        explained_error(occluders, samples, subset, state, d)
    });
    let best = explained
        .into_iter()
        .zip(directions)
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > 0.0).then_some(best.1)
}

/// Moves a direction to a local optimum.
fn refine(
    occluders: &Occluders,
    samples: &[Sample],
    subset: &[u32],
    state: &Residual,
    first: Vec3,
) -> Vec3 {
    let mut best = (
        explained_error(occluders, samples, subset, state, first),
        first,
    );
    for turn in TURNS {
        for _ in 0..4 {
            let (u, v) = best.1.any_orthonormal_pair();
            let around = [u, -u, v, -v, u + v, u - v, -u + v, -u - v]
                .map(|d| (best.1 + d.normalize_or_zero() * turn).normalize_or(best.1));
            let explained = parallel::map(&around, |_, &d| {
                explained_error(occluders, samples, subset, state, d)
            });
            let found = explained
                .into_iter()
                .zip(around)
                .filter(|(_, d)| d.z >= LOWEST)
                .max_by(|a, b| a.0.total_cmp(&b.0));
            match found {
                Some(found) if found.0 > best.0 => best = found,
                _ => break,
            }
        }
    }
    best.1
}
