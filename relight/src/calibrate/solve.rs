//! Non-negative least squares for the strengths of lights.
//!
//! The objective is the absolute logarithmic error |log(computed / stored)| with outliers limited. It is solved by
//! iteratively reweighted least squares: each sample has the weight at which the gradient of its squared error
//! equals that of its squared logarithmic error, reduced for outliers by the Huber loss. For fixed weights,
//! coordinate descent sets one strength at a time to its optimum, a quotient of two sums clamped to its bounds.
//!
//! An L1 penalty on the strength times the length of the column (lasso) makes few lights explain what many could.
//!
//! Source: Holland and Welsch 1977 for reweighting, Huber 1964 for the loss, Friedman et al. 2007 for coordinate
//! descent with an L1 penalty.

use super::columns::Column;
use super::samples::{Sample, mean};
use glam::{Vec3, Vec4};
use support::parallel;
use support::slice;

/// |log ratio| up to which a sample has its full weight.
const HUBER: f32 = 0.3;

/// Weight of the prior, in samples that are off by a factor of e.
const PRIOR_WEIGHT: f32 = 0.5;

/// The ambient term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ambient {
    /// Radiance from all directions.
    pub value: Vec3,
    /// Upper bound.
    pub limit: Vec3,
}

/// Effort of a solution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Reweighting rounds.
    pub rounds: usize,
    /// Coordinate-descent sweeps in each round.
    pub sweeps: usize,
    /// L1 penalty on placed lights.
    pub sparsity: f32,
    /// Whether the current strengths are a guess from which the first weights must not be computed.
    pub anew: bool,
}

/// Residuals and weights of a state.
pub(super) struct Residual {
    /// Stored minus computed light, irradiance over π.
    pub rest: Vec<Vec3>,
    /// Weights; 0 for held-out samples.
    pub weights: Vec<f32>,
}

/// Computed light at every sample: direct, reflected and ambient.
pub(super) fn predict(samples: &[Sample], columns: &[Column], ambient: Vec3) -> Vec<Vec3> {
    let mut light: Vec<Vec3> = samples
        .iter()
        .map(|s| s.bounce + ambient * s.ambient())
        .collect();
    add(columns, &mut light);
    light
}

/// Direct light at every sample.
pub(super) fn direct(samples: &[Sample], columns: &[Column]) -> Vec<Vec3> {
    let mut light = vec![Vec3::ZERO; samples.len()];
    add(columns, &mut light);
    light
}

/// Adds the contributions of columns.
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

/// Residuals and weights of the current state.
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
    // The gradient of off² / 2 at c is off / c; that of w (c - s)² / 2 is the same with this w.
    let slope = if off.abs() < 1e-3 {
        1.0 / (c * s)
    } else {
        off / (c * (c - s))
    };
    slope * (HUBER / off.abs().max(HUBER)) * sample.trust
}

/// Fits the strengths of `columns` and the ambient term. `cutoff`: light cutoff, irradiance over π; 0 for none.
pub(super) fn solve(
    samples: &[Sample],
    columns: &mut [Column],
    ambient: &mut Ambient,
    effort: Effort,
    cutoff: f32,
) -> Residual {
    let mut state = residual(samples, columns, ambient.value);
    for round in 0..effort.rounds {
        if cutoff > 0.0 {
            parallel::each(columns, |column| column.apply_cutoff(cutoff));
        }
        if round > 0 {
            state = residual(samples, columns, ambient.value);
        } else if effort.anew {
            // First weights from the stored level, not from its square: samples that are dark for other reasons
            // than weak lights would dominate.
            let known = || samples.iter().filter(|s| s.trust > 0.0).map(Sample::level);
            let mean = known().sum::<f32>() / known().count().max(1) as f32;
            for (weight, sample) in state.weights.iter_mut().zip(samples) {
                if *weight > 0.0 {
                    let level = (sample.level() + sample.floor) * (mean + sample.floor);
                    *weight = sample.trust / level;
                }
            }
        }
        let both = state.rest.iter().zip(&state.weights);
        let mut rest: Vec<Vec4> = both.map(|(rest, weight)| rest.extend(*weight)).collect();
        let active = parallel::map(columns, |_, column| ActiveRows::of(column, &rest));
        for sweep in 0..effort.sweeps {
            // Dark lights seldom return: they are visited in every fourth sweep only.
            let all = sweep % 4 == 0 || sweep + 1 == effort.sweeps;
            let visited: Vec<usize> = (columns.iter().zip(&active).enumerate())
                .filter(|(_, (column, active))| (all || is_lit(column)) && active.norm > 0.0)
                .map(|(index, _)| index)
                .collect();
            sweep_over(columns, &active, &visited, &mut rest, effort.sparsity);
            improve_ambient(samples, ambient, &mut rest);
        }
    }
    if cutoff > 0.0 {
        parallel::each(columns, |column| column.apply_cutoff(cutoff));
    }
    residual(samples, columns, ambient.value)
}

/// Weighted squared length of a column.
pub(super) fn norm(column: &Column, weights: &[f32]) -> f32 {
    let weight = |i: u32| weights.get(i as usize).copied().unwrap_or(0.0);
    column.rows.iter().map(|&(i, a)| weight(i) * a * a).sum()
}

/// Rows of a column at samples of non-zero weight.
struct ActiveRows {
    rows: Vec<(u32, f32)>,
    /// Weighted squared length.
    norm: f32,
}

impl ActiveRows {
    fn of(column: &Column, rest: &[Vec4]) -> ActiveRows {
        let weight = |i: u32| rest.get(i as usize).map_or(0.0, |rest| rest.w);
        let rows = column.rows.iter().copied();
        let rows: Vec<(u32, f32)> = rows.filter(|(i, _)| weight(*i) != 0.0).collect();
        let norm = rows.iter().map(|&(i, a)| weight(i) * a * a).sum();
        ActiveRows { rows, norm }
    }
}

fn is_lit(column: &Column) -> bool {
    column.strength != Vec3::ZERO
}

/// Dark columns whose sums are computed together, so that additions overlap.
const AT_ONCE: usize = 4;

/// Sets each column in turn to its optimal strength with all others fixed. `rest`: residual, and the weight in w.
fn sweep_over(
    columns: &mut [Column],
    active: &[ActiveRows],
    visited: &[usize],
    rest: &mut [Vec4],
    sparsity: f32,
) {
    let mut done = 0;
    while let Some(left) = visited.get(done..).filter(|left| !left.is_empty()) {
        // A lit column changes the residual, and so the sums of the others.
        let is_out = |i: &&usize| columns.get(**i).is_some_and(|c| !is_lit(c));
        let out = left.iter().take(AT_ONCE).take_while(is_out).count();
        let (now, _) = left.split_at(out.max(1));
        let mut rows: [&[(u32, f32)]; AT_ONCE] = [&[]; AT_ONCE];
        for (rows, index) in rows.iter_mut().zip(now) {
            *rows = active.get(*index).map_or(&[], |active| &active.rows);
        }
        for (&index, sum) in now.iter().zip(sums(rows, rest)) {
            done += 1;
            let (Some(column), Some(active)) =
                (slice::get_mut(columns, index), slice::get(active, index))
            else {
                continue;
            };
            let change = improve(column, active.norm, sum.truncate(), sparsity);
            if change != Vec3::ZERO {
                let change = change.extend(0.0);
                for &(i, a) in &active.rows {
                    if let Some(rest) = rest.get_mut(i as usize) {
                        *rest -= change * a;
                    }
                }
                // The other sums are out of date.
                break;
            }
        }
    }
}

/// Gradient of each column: the sum of residual times weight times contribution.
fn sums(rows: [&[(u32, f32)]; AT_ONCE], rest: &[Vec4]) -> [Vec4; AT_ONCE] {
    let mut sums = [Vec4::ZERO; AT_ONCE];
    let term = |(i, a): (u32, f32)| {
        let rest = rest.get(i as usize).copied().unwrap_or(Vec4::ZERO);
        rest * (rest.w * a)
    };
    let together = rows.iter().map(|rows| rows.len()).min().unwrap_or(0);
    let (first, more) = (rows.map(|r| &r[..together]), rows.map(|r| &r[together..]));
    for row in 0..together {
        for (sum, rows) in sums.iter_mut().zip(first) {
            *sum += term(rows[row]);
        }
    }
    for (sum, rows) in sums.iter_mut().zip(more) {
        for row in rows {
            *sum += term(*row);
        }
    }
    sums
}

/// Sets a column to its optimal strength with all others fixed; returns the change.
fn improve(column: &mut Column, norm: f32, gradient: Vec3, sparsity: f32) -> Vec3 {
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
    if !change.is_finite() {
        return Vec3::ZERO;
    }
    column.strength = best;
    change
}

fn improve_ambient(samples: &[Sample], ambient: &mut Ambient, rest: &mut [Vec4]) {
    let mut gradient = Vec4::ZERO;
    let mut norm = 0.0;
    for (sample, rest) in samples.iter().zip(rest.iter()) {
        let weight = rest.w * sample.ambient();
        gradient += *rest * weight;
        norm += weight;
    }
    if norm <= 0.0 {
        return;
    }
    let gradient = gradient.truncate();
    let best = (ambient.value + gradient / norm).clamp(Vec3::ZERO, ambient.limit.max(Vec3::ZERO));
    let change = best - ambient.value;
    if change.is_finite() && change != Vec3::ZERO {
        ambient.value = best;
        let change = change.extend(0.0);
        for (rest, sample) in rest.iter_mut().zip(samples) {
            *rest -= change * sample.ambient();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::columns::{Lamp, Source};
    use crate::light::Falloff;
    use support::random::Random;

    #[test]
    fn batched_columns_equal_sequential_ones() {
        let mut random = Random::new(3);
        let origin = Vec3::ZERO;
        let falloff = Falloff::InverseSquare;
        let mut rows = || -> Vec<(u32, f32)> {
            let chosen: Vec<u32> = (0..50).filter(|_| random.uniform() < 0.3).collect();
            chosen.into_iter().map(|i| (i, random.uniform())).collect()
        };
        let columns: Vec<Column> = (0..60)
            .map(|_| Column {
                source: Source::Placed(Lamp { origin, falloff }),
                rows: rows(),
                pieces: Vec::new(),
                strength: Vec3::ZERO,
                limit: Vec3::INFINITY,
                prior: None,
            })
            .collect();
        let rest: Vec<Vec4> = (0..50)
            .map(|_| Vec4::new(random.uniform(), random.uniform(), random.uniform(), 1.0))
            .collect();
        let active: Vec<ActiveRows> = columns.iter().map(|c| ActiveRows::of(c, &rest)).collect();
        let all: Vec<usize> = (0..columns.len()).collect();
        let (mut together, mut rest_together) = (columns.clone(), rest.clone());
        let (mut alone, mut rest_alone) = (columns, rest);
        for _ in 0..3 {
            sweep_over(&mut together, &active, &all, &mut rest_together, 0.4);
            for index in &all {
                sweep_over(&mut alone, &active, &[*index], &mut rest_alone, 0.4);
            }
        }
        let strengths = |columns: &[Column]| -> Vec<Vec3> {
            columns.iter().map(|column| column.strength).collect()
        };
        assert_eq!(strengths(&together), strengths(&alone));
        assert_eq!(rest_together, rest_alone);
        let lit = alone.iter().filter(|column| is_lit(column)).count();
        assert!((5..55).contains(&lit), "{lit}");
    }
}
