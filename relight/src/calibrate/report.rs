//! Agreement of computed light with stored light.

use super::samples::{Sample, light_of, mean};
use crate::emitters::Agreement;
use crate::world::RelitWorld;
use glam::Vec3;

/// Stored light below which ratios are not formed, steps of a byte.
const DARK: f32 = 2.0;

/// Smallest computed light in a ratio, steps of a byte.
const BLACK: f32 = 0.25;

impl Agreement {
    /// Over held-out samples that are neither saturated nor dark.
    pub(super) fn of(world: &RelitWorld, samples: &[Sample], computed: &[Vec3]) -> Agreement {
        let (dark, black) = (light_of(world, DARK), light_of(world, BLACK));
        let judged = || {
            samples
                .iter()
                .zip(computed)
                .filter(|(s, _)| s.held_out && !s.saturated && s.level() * s.part >= dark)
                .map(|(s, c)| (s.level() * s.part, mean(*c) * s.part))
        };
        let mut stops: Vec<f32> = judged()
            .map(|(stored, computed)| {
                (computed.max(black) / stored).log2().abs() / world.stored_gamma
            })
            .collect();
        stops.sort_by(f32::total_cmp);
        let quantile = |q: f32| {
            let at = (stops.len().saturating_sub(1) as f32 * q) as usize;
            stops.get(at).copied().unwrap_or(0.0)
        };
        let (stored, computed) = judged().fold((0.0f64, 0.0f64), |(s, c), (stored, computed)| {
            (s + f64::from(stored), c + f64::from(computed))
        });
        Agreement {
            median_stops: quantile(0.5),
            worst_tenth_stops: quantile(0.9),
            sum_ratio: if stored > 0.0 {
                (computed / stored) as f32
            } else {
                0.0
            },
        }
    }
}
