//! Blue noise: a square of numbers without low frequencies, which tiles the plane.

use crate::random::Random;

/// Standard deviation of the filter that measures how crowded a place is, texels (Ulichney, The void-and-cluster method
/// for dither array generation, 1993, uses 1.5).
const SIGMA: f32 = 1.5;

/// The texels of a square of `size` × `size`, row by row, in the order of a void-and-cluster array: each of the numbers 0
/// to `size`² - 1 once. For any threshold the texels below it are spread evenly.
pub fn void_and_cluster(size: usize, seed: u64) -> Vec<u32> {
    let count = size * size;
    let mut pattern = Pattern::new(size);
    let mut random = Random::new(seed);
    // a tenth of the texels, spread evenly by moving the most crowded one into the largest void
    let ones = count / 10;
    while pattern.ones() < ones {
        pattern.set(random.below(count), true);
    }
    loop {
        let cluster = pattern.most_crowded(true);
        pattern.set(cluster, false);
        let void = pattern.least_crowded();
        pattern.set(void, true);
        if void == cluster {
            break;
        }
    }
    let mut ranks = vec![0; count];
    let mut rest = pattern.clone();
    for rank in (0..ones).rev() {
        let cluster = rest.most_crowded(true);
        rest.set(cluster, false);
        ranks[cluster] = rank as u32;
    }
    for rank in ones..count {
        let void = pattern.least_crowded();
        pattern.set(void, true);
        ranks[void] = rank as u32;
    }
    ranks
}

/// A binary pattern, and how crowded each of its texels is.
#[derive(Clone)]
struct Pattern {
    size: usize,
    set: Vec<bool>,
    crowd: Vec<f32>,
    /// Weight of a texel by its distance along both axes.
    filter: Vec<f32>,
}

impl Pattern {
    fn new(size: usize) -> Self {
        let weight = |distance: usize| {
            // the nearest of the tiles
            let near = distance.min(size - distance) as f32;
            (-near * near / (2.0 * SIGMA * SIGMA)).exp()
        };
        let axis: Vec<f32> = (0..size).map(weight).collect();
        let filter = axis.iter().flat_map(|y| axis.iter().map(move |x| x * y));
        Self {
            size,
            set: vec![false; size * size],
            crowd: vec![0.0; size * size],
            filter: filter.collect(),
        }
    }

    fn ones(&self) -> usize {
        self.set.iter().filter(|set| **set).count()
    }

    fn set(&mut self, texel: usize, on: bool) {
        if self.set[texel] == on {
            return;
        }
        self.set[texel] = on;
        let sign = if on { 1.0 } else { -1.0 };
        let (x, y) = (texel % self.size, texel / self.size);
        for (row, crowd) in self.crowd.chunks_exact_mut(self.size).enumerate() {
            let filter = &self.filter[row.abs_diff(y) * self.size..][..self.size];
            for (column, crowd) in crowd.iter_mut().enumerate() {
                *crowd += sign * filter[column.abs_diff(x)];
            }
        }
    }

    /// Of the texels that are set or not, the one with the most neighbours that are set.
    fn most_crowded(&self, set: bool) -> usize {
        let of = (0..self.set.len()).filter(|texel| self.set[*texel] == set);
        of.max_by(|a, b| self.crowd[*a].total_cmp(&self.crowd[*b]))
            .unwrap_or(0)
    }

    /// Of the texels that are not set, the one with the fewest neighbours that are set.
    fn least_crowded(&self) -> usize {
        let of = (0..self.set.len()).filter(|texel| !self.set[*texel]);
        of.min_by(|a, b| self.crowd[*a].total_cmp(&self.crowd[*b]))
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    const SIZE: usize = 32;

    /// Power of these values at frequencies of up to `most` periods across the square, over that of independent ones.
    fn low_power(values: &[f32], most: i32) -> f32 {
        let (mut power, mut count) = (0.0, 0.0);
        for (fx, fy) in (-most..=most).flat_map(|x| (-most..=most).map(move |y| (x, y))) {
            if fx * fx + fy * fy > most * most || (fx, fy) == (0, 0) {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in values.iter().enumerate() {
                let (x, y) = ((i % SIZE) as f32, (i / SIZE) as f32);
                let angle = TAU * (fx as f32 * x + fy as f32 * y) / SIZE as f32;
                re += value * angle.cos();
                im += value * angle.sin();
            }
            power += re * re + im * im;
            count += 1.0;
        }
        let variance: f32 = values.iter().map(|v| v * v).sum();
        power / count / variance
    }

    #[test]
    fn ranks_occur_once_and_lack_low_frequencies() {
        let ranks = void_and_cluster(SIZE, 1);
        let mut sorted = ranks.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..(SIZE * SIZE) as u32).collect::<Vec<_>>());
        let centred = |rank: u32| (rank as f32 + 0.5) / (SIZE * SIZE) as f32 - 0.5;
        let values: Vec<f32> = ranks.iter().map(|rank| centred(*rank)).collect();
        let mut random = Random::new(2);
        let white: Vec<f32> = (0..SIZE * SIZE).map(|_| random.uniform() - 0.5).collect();
        let (blue, white) = (low_power(&values, 5), low_power(&white, 5));
        assert!(white > 0.5 && blue < 0.05, "{blue} and {white}");
    }

    #[test]
    fn texels_below_any_threshold_lack_low_frequencies() {
        let ranks = void_and_cluster(SIZE, 3);
        for part in [16, 4, 2] {
            let limit = (SIZE * SIZE / part) as u32;
            let below = |rank: &u32| f32::from(u8::from(*rank < limit)) - 1.0 / part as f32;
            let power = low_power(&ranks.iter().map(below).collect::<Vec<_>>(), 3);
            assert!(power < 0.25, "below {limit}: {power}");
        }
    }
}
