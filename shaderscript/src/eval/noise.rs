//! Four-dimensional value noise.
//!
//! The engine fills its lattice from the C library's `rand()`, so its noise differs from system to system and from run
//! to run; only the scheme is fixed: 256 values in -1..1, found by a chained permutation of the four lattice
//! coordinates, blended linearly. The tables here are those that come out with glibc's generator as a program finds it
//! (seed 1), so that the two can be compared.

use std::sync::OnceLock;

/// Lattice values, and length of the permutation.
pub const NOISE_SIZE: usize = 256;

struct Tables {
    values: [f32; NOISE_SIZE],
    permutation: [u8; NOISE_SIZE],
}

/// glibc's `rand()` with seed 1: an additive feedback generator of degree 31 with taps 3 and 31, whose first words come
/// from the minimal standard generator (multiplier 16807, modulus 2^31 - 1) and whose first 310 outputs are dropped.
struct Random {
    /// The next word to change comes first.
    words: [u32; 31],
}

impl Random {
    fn new() -> Self {
        let mut word = 1_u64;
        let mut words: [u32; 31] = std::array::from_fn(|_| {
            let here = word as u32;
            word = word * 16_807 % 0x7FFF_FFFF;
            here
        });
        words.rotate_left(3);
        let mut random = Self { words };
        for _ in 0..310 {
            random.number();
        }
        random
    }

    /// The next number below 2^31.
    fn number(&mut self) -> u32 {
        self.words[0] = self.words[0].wrapping_add(self.words[28]);
        let number = self.words[0] >> 1;
        self.words.rotate_left(1);
        number
    }

    /// In 0..=1, as the engine computes it in single precision.
    fn unit(&mut self) -> f32 {
        self.number() as f32 / 0x7FFF_FFFF as f32
    }
}

fn tables() -> &'static Tables {
    static TABLES: OnceLock<Tables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let mut random = Random::new();
        let mut values = [0.0; NOISE_SIZE];
        // No true permutation: the engine draws with replacement.
        let mut permutation = [0; NOISE_SIZE];
        for (value, entry) in values.iter_mut().zip(&mut permutation) {
            *value = (f64::from(random.unit()) * 2.0 - 1.0) as f32;
            *entry = (random.unit() * 255.0) as u8;
        }
        Tables {
            values,
            permutation,
        }
    })
}

/// The lattice's values, for the GPU's copy.
pub fn noise_values() -> &'static [f32; NOISE_SIZE] {
    &tables().values
}

/// The permutation, for the GPU's copy.
pub fn noise_permutation() -> &'static [u8; NOISE_SIZE] {
    &tables().permutation
}

/// Noise in -1..1 at a point of space and time; lattice cells have size 1.
pub fn noise4(x: f32, y: f32, z: f32, t: f64) -> f32 {
    let tables = tables();
    let cell = |v: f64| {
        let floor = v.floor();
        // Saturating: far outside the lattice the noise is constant instead of wrong.
        (floor as i64, (v - floor) as f32)
    };
    let (ix, fx) = cell(f64::from(x));
    let (iy, fy) = cell(f64::from(y));
    let (iz, fz) = cell(f64::from(z));
    let (it, ft) = cell(t);
    // Masked to the length of the tables, so that the entry exists.
    let permuted = |i: i64| {
        let entry = tables.permutation.get((i & 255) as usize);
        entry.map_or(0, |&entry| i64::from(entry))
    };
    let corner = |dx: i64, dy: i64, dz: i64, dt: i64| {
        let at = |i: i64, d: i64| i.wrapping_add(d);
        let index = permuted(at(ix, dx).wrapping_add(permuted(
            at(iy, dy).wrapping_add(permuted(at(iz, dz).wrapping_add(permuted(at(it, dt))))),
        )));
        let value = tables.values.get((index & 255) as usize);
        value.copied().unwrap_or(0.0)
    };
    let lerp = |a: f32, b: f32, f: f32| a * (1.0 - f) + b * f;
    let plane = |dz: i64, dt: i64| {
        lerp(
            lerp(corner(0, 0, dz, dt), corner(1, 0, dz, dt), fx),
            lerp(corner(0, 1, dz, dt), corner(1, 1, dz, dt), fx),
            fy,
        )
    };
    let volume = |dt: i64| lerp(plane(0, dt), plane(1, dt), fz);
    lerp(volume(0), volume(1), ft)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_the_documented_form() {
        let mean = noise_values().iter().sum::<f32>() / NOISE_SIZE as f32;
        assert!(mean.abs() < 0.15, "{mean}");
        assert!(noise_values().iter().all(|v| v.abs() <= 1.0));
        assert!(noise_values().iter().any(|v| *v > 0.8));
        assert!(noise_values().iter().any(|v| *v < -0.8));
        // The generator's first numbers, as in every C program without a seed.
        let mut random = Random::new();
        let first: [u32; 4] = std::array::from_fn(|_| random.number());
        assert_eq!(
            first,
            [1_804_289_383, 846_930_886, 1_681_692_777, 1_714_636_915]
        );
        assert_eq!(noise_permutation()[0], 100);
    }

    #[test]
    fn lattice_points_give_lattice_values_and_middles_their_mean() {
        let p = |i: usize| usize::from(noise_permutation()[i & 255]);
        let lattice =
            |x: usize, y: usize, z: usize, t: usize| noise_values()[p(x + p(y + p(z + p(t))))];
        assert_eq!(noise4(3.0, 4.0, 5.0, 6.0), lattice(3, 4, 5, 6));
        let mean = (lattice(3, 4, 5, 6) + lattice(4, 4, 5, 6)) / 2.0;
        assert!((noise4(3.5, 4.0, 5.0, 6.0) - mean).abs() < 1e-6);
        let mean = (lattice(3, 4, 5, 6) + lattice(3, 4, 5, 7)) / 2.0;
        assert!((noise4(3.0, 4.0, 5.0, 6.5) - mean).abs() < 1e-6);
        // Negative coordinates wrap to the lattice's other end.
        assert_eq!(noise4(-1.0, 0.0, 0.0, 0.0), lattice(255, 0, 0, 0));
    }

    #[test]
    fn any_argument_gives_a_value() {
        for v in [f32::MAX, f32::MIN, f32::INFINITY, f32::NAN] {
            let _ = noise4(v, v, v, f64::from(v));
        }
    }
}
