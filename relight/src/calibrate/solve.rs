//! Non-negative least squares for the strengths of lights.
//!
//! Wanted is the smallest |log(computed / stored)| of most samples. Near the solution that is a least squares problem
//! in which a sample weighs so much that the slope of its square is that of its logarithm's square, and less when it
//! is far off (Huber); weights and solution take
//! turns (iteratively reweighted least squares), the solution by coordinate descent: with all other strengths held,
//! the best of one is a quotient of two sums, cut at its bounds.
//!
//! A penalty on strength, measured by the column's length, makes few lights explain what many could (L1, "lasso").
//!
//! Source: Holland and Welsch 1977 for the reweighting, Huber 1964 for the loss, Friedman et al. 2007 for coordinate
//! descent with an L1 penalty.

use super::columns::Column;
use super::samples::{Sample, mean};
use glam::Vec3;

/// |log ratio| up to which a sample counts in full.
const HUBER: f32 = 0.3;

/// Weight of what directives say, counted in samples that are off by a factor e.
const PRIOR_WEIGHT: f32 = 0.5;

/// The constant part of all samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ambient {
    /// Radiance from everywhere.
    pub value: Vec3,
    /// Its largest value.
    pub limit: Vec3,
}

/// How long and how to solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Times that weights are computed anew.
    pub rounds: usize,
    /// Sweeps over all columns in each.
    pub sweeps: usize,
    /// Penalty on placed lights.
    pub sparsity: f32,
    /// Whether what there is so far is a guess that weights should not come from.
    pub anew: bool,
}

/// State of a solution: light not yet explained, and what each sample weighs.
pub(super) struct Residual {
    /// Stored less computed.
    pub rest: Vec<Vec3>,
    /// Weights; 0 for samples held out.
    pub weights: Vec<f32>,
}

/// Computed light at every sample: ambient, bounced and direct.
pub(super) fn predict(samples: &[Sample], columns: &[Column], ambient: Vec3) -> Vec<Vec3> {
    let mut light: Vec<Vec3> = samples
        .iter()
        .map(|s| s.bounce + ambient * s.ambient())
        .collect();
    add(columns, &mut light);
    light
}

/// Direct light alone, without ambient.
pub(super) fn direct(samples: &[Sample], columns: &[Column]) -> Vec<Vec3> {
    let mut light = vec![Vec3::ZERO; samples.len()];
    add(columns, &mut light);
    light
}

/// Adds what columns give.
fn add(columns: &[Column], light: &mut [Vec3]) {
    for column in columns {
        if column.strength == Vec3::ZERO {
            continue;
        }
        for &(i, a) in &column.rows {
            if let Some(sum) = light.get_mut(i as usize) {
                *sum += column.strength * a;
            }
        }
    }
}

/// Residual and weights of what is there now.
pub(super) fn residual(samples: &[Sample], columns: &[Column], ambient: Vec3) -> Residual {
    let computed = predict(samples, columns, ambient);
    let pairs = || samples.iter().zip(&computed);
    Residual {
        rest: pairs().map(|(s, c)| s.value - *c).collect(),
        weights: pairs().map(|(s, c)| weight(s, mean(*c))).collect(),
    }
}

fn weight(sample: &Sample, computed: f32) -> f32 {
    let stored = sample.level();
    if sample.held_out || (sample.saturated && computed >= stored) {
        return 0.0;
    }
    let (c, s) = (computed.max(0.0) + sample.floor, stored + sample.floor);
    let off = (c / s).ln();
    // The slope of off² / 2 at c is off / c; that of w (c - s)² / 2 is the same with this w.
    let slope = if off.abs() < 1e-3 {
        1.0 / (c * s)
    } else {
        off / (c * (c - s))
    };
    slope * (HUBER / off.abs().max(HUBER)) * sample.trust
}

/// Fits the strengths of `columns` and the ambient term.
pub(super) fn solve(
    samples: &[Sample],
    columns: &mut [Column],
    ambient: &mut Ambient,
    effort: Effort,
    least: f32,
) -> Residual {
    let mut state = residual(samples, columns, ambient.value);
    for round in 0..effort.rounds {
        if least > 0.0 {
            for column in columns.iter_mut() {
                column.end_at(least);
            }
        }
        if round > 0 {
            state = residual(samples, columns, ambient.value);
        } else if effort.anew {
            // Nothing is known yet: every sample by its own level. Not by its square: what lies in the dark for another
            // reason than the lights' weakness would decide all.
            let known = || samples.iter().filter(|s| s.trust > 0.0).map(Sample::level);
            let mean = known().sum::<f32>() / known().count().max(1) as f32;
            for (weight, sample) in state.weights.iter_mut().zip(samples) {
                if *weight > 0.0 {
                    let level = (sample.level() + sample.floor) * (mean + sample.floor);
                    *weight = sample.trust / level;
                }
            }
        }
        let norms: Vec<f32> = columns
            .iter()
            .map(|column| norm(column, &state.weights))
            .collect();
        for sweep in 0..effort.sweeps {
            // Lights that are out seldom come back: they are looked at now and then.
            let all = sweep % 4 == 0 || sweep + 1 == effort.sweeps;
            for (column, &norm) in columns.iter_mut().zip(&norms) {
                if (all || column.strength != Vec3::ZERO) && norm > 0.0 {
                    improve(column, norm, &mut state, effort.sparsity);
                }
            }
            improve_ambient(samples, ambient, &mut state);
        }
    }
    if least > 0.0 {
        for column in columns.iter_mut() {
            column.end_at(least);
        }
    }
    residual(samples, columns, ambient.value)
}

/// Weighted square of a column's length.
pub(super) fn norm(column: &Column, weights: &[f32]) -> f32 {
    let weight = |i: u32| weights.get(i as usize).copied().unwrap_or(0.0);
    column.rows.iter().map(|&(i, a)| weight(i) * a * a).sum()
}

/// Sets a column to its best strength while all others stay.
fn improve(column: &mut Column, norm: f32, state: &mut Residual, sparsity: f32) {
    let mut gradient = Vec3::ZERO;
    for &(i, a) in &column.rows {
        if let (Some(rest), Some(weight)) =
            (state.rest.get(i as usize), state.weights.get(i as usize))
        {
            gradient += *rest * (*weight * a);
        }
    }
    let best = match &column.prior {
        Some(prior) => {
            let scale = prior
                .value
                .max(Vec3::splat(prior.value.max_element() * 0.1));
            let pull = PRIOR_WEIGHT / (scale * scale).max(Vec3::splat(1e-30));
            let best = (gradient + column.strength * norm + prior.value * pull) / (pull + norm);
            best.clamp(prior.low, prior.high.max(prior.low))
        }
        None => {
            let penalty = sparsity * norm.sqrt();
            ((gradient + column.strength * norm - penalty) / norm)
                .max(Vec3::ZERO)
                .min(column.limit)
        }
    };
    let change = best - column.strength;
    if !change.is_finite() || change == Vec3::ZERO {
        return;
    }
    column.strength = best;
    for &(i, a) in &column.rows {
        if let Some(rest) = state.rest.get_mut(i as usize) {
            *rest -= change * a;
        }
    }
}

fn improve_ambient(samples: &[Sample], ambient: &mut Ambient, state: &mut Residual) {
    let mut gradient = Vec3::ZERO;
    let mut norm = 0.0;
    for (sample, (rest, &weight)) in samples.iter().zip(state.rest.iter().zip(&state.weights)) {
        let weight = weight * sample.ambient();
        gradient += *rest * weight;
        norm += weight;
    }
    if norm <= 0.0 {
        return;
    }
    let best = (ambient.value + gradient / norm).clamp(Vec3::ZERO, ambient.limit.max(Vec3::ZERO));
    let change = best - ambient.value;
    if change.is_finite() && change != Vec3::ZERO {
        ambient.value = best;
        for (rest, sample) in state.rest.iter_mut().zip(samples) {
            *rest -= change * sample.ambient();
        }
    }
}
