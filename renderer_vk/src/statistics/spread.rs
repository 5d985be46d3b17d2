//! Distribution of times.

use serde::Serialize;

/// How times are distributed, milliseconds; percentiles by nearest rank.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// 50th percentile.
    pub median: f64,
    /// 5th percentile.
    pub p5: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// The greatest.
    pub worst: f64,
}

impl Spread {
    /// Of any number of times but none.
    pub fn of(times: &[f32]) -> Option<Self> {
        let mut sorted = times.to_vec();
        sorted.sort_by(f32::total_cmp);
        let at = |percent| percentile(&sorted, percent).map(rounded);
        Some(Self {
            median: at(50)?,
            p5: at(5)?,
            p95: at(95)?,
            p99: at(99)?,
            worst: at(100)?,
        })
    }
}

/// The smallest value that this part of all values does not exceed (nearest rank). The values ascend; percentages above
/// 100 are 100. `None`: no values.
fn percentile(ascending: &[f32], percent: usize) -> Option<f32> {
    let rank = (percent.min(100) * ascending.len()).div_ceil(100).max(1);
    ascending.get(rank - 1).copied()
}

/// Four digits of a millisecond.
fn rounded(ms: f32) -> f64 {
    (f64::from(ms) * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_by_nearest_rank() {
        let values = [15.0, 20.0, 35.0, 40.0, 50.0];
        for (percent, value) in [
            (0, 15.0),
            (5, 15.0),
            (20, 15.0),
            (21, 20.0),
            (30, 20.0),
            (40, 20.0),
            (50, 35.0),
            (99, 50.0),
            (100, 50.0),
            (200, 50.0),
        ] {
            assert_eq!(percentile(&values, percent), Some(value), "{percent}");
        }
        assert_eq!(percentile(&[7.0], 5), Some(7.0));
        assert_eq!(percentile(&[], 50), None);
        let hundred: Vec<f32> = (1..=100u8).rev().map(f32::from).collect();
        let spread = Spread::of(&hundred).expect("values");
        assert_eq!((spread.p5, spread.median, spread.p95), (5.0, 50.0, 95.0));
        assert_eq!((spread.p99, spread.worst), (99.0, 100.0));
        assert_eq!(Spread::of(&[]), None);
        assert!(Spread::of(&[f32::NAN, 1.0]).is_some());
    }
}
