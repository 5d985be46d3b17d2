//! How well traced light agrees with stored light.

use super::samples::{Evidence, Sample, light_of, mean};
use crate::world::RelitWorld;
use glam::Vec3;

/// Stored light below which ratios mean nothing, steps of a byte.
const DARK: f32 = 2.0;

/// Least computed light in a ratio, steps of a byte: black counts as this.
const BLACK: f32 = 0.25;

/// Computed light against stored light, over measurements that fitting did not see.
///
/// Stops are those of what is stored: what a map's compiler is known to have done to light before it stored it (a gamma,
/// darker corners) is done to computed light, too.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Agreement {
    /// Median of |log2(computed / stored)|, stops: 0 is perfect, 1 is a factor of two.
    pub median_stops: f32,
    /// Nine in ten are better than this, stops.
    pub worst_tenth_stops: f32,
    /// Sum of computed over sum of stored light.
    pub sum_ratio: f32,
}

impl Agreement {
    /// Of samples that are held out, not cut off and not all dark.
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

/// What calibration did.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationReport {
    /// What told of light.
    pub evidence: Evidence,
    /// Measurements taken.
    pub samples: usize,
    /// Of those, kept out of fitting.
    pub held_out: usize,
    /// Sources that the map's directives tell of; the triangle lights of one material count once.
    pub known: usize,
    /// Lights put in.
    pub placed: usize,
    /// Back splashes put in: weak lights in front of lamps, as the compiler had them.
    pub splashes: usize,
    /// Suns put in.
    pub suns: usize,
    /// Gamma that the compiler encoded light with before it stored it: see
    /// [`RelitWorld::stored_gamma`](crate::RelitWorld::stored_gamma).
    pub gamma: f32,
    /// Whether the map's lights end where they give little: see [`RelitWorld::light_end`](crate::RelitWorld::light_end).
    pub ends: bool,
    /// Whether the compiler made corners darker (its *dirt*): what it stored is compared with light made as dark.
    pub dirty: bool,
    /// Agreement of the light that directives tell of: direct, ambient and bounced.
    pub before: Agreement,
    /// Agreement of calibrated light: direct, ambient and bounced.
    pub after: Agreement,
    /// Whether the result was kept from an earlier time.
    pub cached: bool,
    /// Time that it took.
    pub seconds: f64,
}

impl Default for CalibrationReport {
    /// Nothing done, of a map that stores light as it is.
    fn default() -> Self {
        CalibrationReport {
            evidence: Evidence::Nothing,
            samples: 0,
            held_out: 0,
            known: 0,
            placed: 0,
            splashes: 0,
            suns: 0,
            gamma: 1.0,
            ends: false,
            dirty: false,
            before: Agreement::default(),
            after: Agreement::default(),
            cached: false,
            seconds: 0.0,
        }
    }
}
