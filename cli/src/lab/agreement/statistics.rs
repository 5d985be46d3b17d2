//! Statistics of the differences of stored light.

use glam::Vec3;
use serde::Serialize;

/// How bytes are read as light.
#[derive(Debug, Clone, Copy)]
pub struct Decoding {
    /// Exponent that the compiler's `-gamma` undid.
    pub gamma: f32,
    /// Divisor of `-compensate`.
    pub compensate: f32,
    /// Luminance of stored light below which light counts as equally dark, of 255.
    pub floor: f32,
}

impl Decoding {
    /// Luminance of a stored colour, linear, 0 to 255.
    fn luminance(&self, bytes: [u8; 3]) -> f32 {
        let linear = bytes.map(|byte| {
            let value = f32::from(byte) * self.compensate / 255.0;
            value.powf(self.gamma) * 255.0
        });
        relight::overbright::luminance(Vec3::from_array(linear))
    }

    /// Logarithm to base 2 of `b` over `a`, neither darker than the floor.
    fn stops(&self, (a, b): ([u8; 3], [u8; 3])) -> f32 {
        (self.luminance(b).max(self.floor) / self.luminance(a).max(self.floor)).log2()
    }
}

/// Differences of two maps at the same places.
#[derive(Debug, Clone, Default, Serialize, PartialEq)]
pub struct Differences {
    /// Places compared.
    pub places: usize,
    /// Share of places that are darker than the floor in both.
    pub dark: f64,
    /// Median of log2 of the second map's luminance over the first's, stops.
    pub bias_stops: f64,
    /// Median of its absolute value.
    pub median_stops: f64,
    /// Its 95th percentile.
    pub p95_stops: f64,
    /// Share of places within half a stop.
    pub within_half_stop: f64,
    /// Median of the largest difference of a channel, bytes.
    pub median_bytes: f64,
    /// Its 95th percentile.
    pub p95_bytes: f64,
    /// The largest.
    pub most_bytes: f64,
}

impl Differences {
    /// Of pairs of stored colours. `None` without any.
    pub fn of(pairs: &[([u8; 3], [u8; 3])], decoding: Decoding) -> Option<Differences> {
        let mut stops: Vec<f32> = pairs.iter().map(|p| decoding.stops(*p)).collect();
        let bytes = pairs.iter().map(|(a, b)| {
            let most = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
            f32::from(most.unwrap_or(0))
        });
        let mut bytes: Vec<f32> = bytes.collect();
        let dark = |p: &&([u8; 3], [u8; 3])| {
            decoding.luminance(p.0).max(decoding.luminance(p.1)) < decoding.floor
        };
        let dark = pairs.iter().filter(dark).count();
        let bias_stops = percentile(&mut stops, 0.5)?;
        stops.iter_mut().for_each(|s| *s = s.abs());
        let within = stops.iter().filter(|s| **s <= 0.5).count();
        let share = |part: usize| part as f64 / pairs.len().max(1) as f64;
        Some(Differences {
            places: pairs.len(),
            dark: share(dark),
            bias_stops,
            median_stops: percentile(&mut stops, 0.5)?,
            p95_stops: percentile(&mut stops, 0.95)?,
            within_half_stop: share(within),
            median_bytes: percentile(&mut bytes, 0.5)?,
            p95_bytes: percentile(&mut bytes, 0.95)?,
            most_bytes: percentile(&mut bytes, 1.0)?,
        })
    }

    /// One row of a table.
    pub fn row(&self, name: &str) -> String {
        format!(
            "{name:28} {:>8} {:>6.1} {:>8.3} {:>8.3} {:>7.3} {:>7.2} {:>6.0} {:>5.0} {:>5.0}",
            self.places,
            100.0 * self.dark,
            self.bias_stops,
            self.median_stops,
            self.p95_stops,
            100.0 * self.within_half_stop,
            self.median_bytes,
            self.p95_bytes,
            self.most_bytes,
        )
    }

    /// Heads of the columns of [`row`](Self::row).
    pub fn heads() -> String {
        format!(
            "{:28} {:>8} {:>6} {:>8} {:>8} {:>7} {:>7} {:>6} {:>5} {:>5}",
            "", "places", "dark", "bias", "median", "95 %", "within", "bytes", "95 %", "most"
        )
    }
}

/// The value that a part of the values does not exceed (nearest rank). `None` without values.
pub fn percentile(values: &mut [f32], part: f64) -> Option<f64> {
    values.sort_by(f32::total_cmp);
    let rank = (part * values.len() as f64).ceil() as usize;
    values
        .get(rank.saturating_sub(1))
        .map(|value| f64::from(*value))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Decoding = Decoding {
        gamma: 1.0,
        compensate: 1.0,
        floor: 2.0,
    };

    #[test]
    fn twice_the_light_is_a_stop() {
        let pairs = [([40; 3], [80; 3]), ([40; 3], [40; 3]), ([50; 3], [100; 3])];
        let found = Differences::of(&pairs, PLAIN).unwrap();
        assert_eq!(found.places, 3);
        assert!((found.bias_stops - 1.0).abs() < 1e-6, "{found:?}");
        assert!((found.median_stops - 1.0).abs() < 1e-6);
        assert!((found.within_half_stop - 1.0 / 3.0).abs() < 1e-9);
        assert_eq!((found.median_bytes, found.most_bytes), (40.0, 50.0));
        assert_eq!(Differences::of(&[], PLAIN), None);
    }

    #[test]
    fn darkness_below_the_floor_is_equal() {
        let pairs = [([0; 3], [1; 3]), ([0; 3], [2; 3]), ([0; 3], [4; 3])];
        let found = Differences::of(&pairs, PLAIN).unwrap();
        assert!((found.dark - 1.0 / 3.0).abs() < 1e-9, "{found:?}");
        assert_eq!(found.median_stops, 0.0);
        assert!((found.p95_stops - 1.0).abs() < 1e-6);
    }

    #[test]
    fn gamma_and_compensation_are_undone() {
        // -gamma 2 -compensate 4 stores 255 sqrt(v / 255) / 4
        let stored = |v: f32| [(255.0 * (v / 255.0).sqrt() / 4.0) as u8; 3];
        let decoding = Decoding {
            gamma: 2.0,
            compensate: 4.0,
            floor: 2.0,
        };
        let found = Differences::of(&[(stored(60.0), stored(120.0))], decoding).unwrap();
        assert!((found.bias_stops - 1.0).abs() < 0.1, "{found:?}");
    }
}
