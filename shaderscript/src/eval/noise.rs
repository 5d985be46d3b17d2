//! Four-dimensional value noise.
//!
//! The engine fills its lattice from the C library's `rand()`, so its noise differs from system to system; only the
//! scheme is fixed: 256 values in -1..1, found by a chained permutation of the four lattice coordinates, blended
//! linearly. Here both tables come from a linear congruential generator (Knuth's MMIX constants: multiplier
//! 6364136223846793005, increment 1442695040888963407, modulus 2^64, seed 0x51A3E; the upper 32 bits are used), and
//! the permutation is a true one (Fisher-Yates shuffle).

use std::sync::OnceLock;

/// Lattice values, and length of the permutation.
pub const NOISE_SIZE: usize = 256;

struct Tables {
    values: [f32; NOISE_SIZE],
    permutation: [u8; NOISE_SIZE],
}

fn tables() -> &'static Tables {
    static TABLES: OnceLock<Tables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let mut state = 0x51A3E_u64;
        let mut random = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 32) as u32
        };
        let values =
            std::array::from_fn(|_| (f64::from(random()) / f64::from(u32::MAX) * 2.0 - 1.0) as f32);
        let mut permutation: [u8; NOISE_SIZE] = std::array::from_fn(|i| i as u8);
        for last in (1..NOISE_SIZE).rev() {
            let other = random() as usize % (last + 1);
            permutation.swap(last, other);
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
    let permuted = |i: i64| i64::from(tables.permutation[(i & 255) as usize]);
    let corner = |dx: i64, dy: i64, dz: i64, dt: i64| {
        let at = |i: i64, d: i64| i.wrapping_add(d);
        let index = permuted(at(ix, dx).wrapping_add(permuted(
            at(iy, dy).wrapping_add(permuted(at(iz, dz).wrapping_add(permuted(at(it, dt))))),
        )));
        tables.values[index as usize & 255]
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
        let mut seen = *noise_permutation();
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(i, &v)| usize::from(v) == i));
        let mean = noise_values().iter().sum::<f32>() / NOISE_SIZE as f32;
        assert!(mean.abs() < 0.15, "{mean}");
        assert!(noise_values().iter().all(|v| v.abs() <= 1.0));
        assert!(noise_values().iter().any(|v| *v > 0.8));
        assert!(noise_values().iter().any(|v| *v < -0.8));
        // First output of the generator: (seed * a + c) >> 32, worked out with big integers.
        let state =
            (0x51A3E_u128 * 6_364_136_223_846_793_005 + 1_442_695_040_888_963_407) % (1_u128 << 64);
        let first = state >> 32;
        let value = (first as f64 / f64::from(u32::MAX) * 2.0 - 1.0) as f32;
        assert_eq!(noise_values()[0], value);
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
