//! A small random generator, so that one map gives one result everywhere.

/// PCG-like: a 64-bit linear congruential generator, of which the high bits are used after a mix.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator of its own for every seed.
    pub fn new(seed: u64) -> Random {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03);
        random.uniform();
        random
    }

    /// Evenly in 0..1, 1 excluded.
    pub fn uniform(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ (self.0 >> 22)) >> 29;
        (mixed & 0xFF_FFFF) as f32 / (1u32 << 24) as f32
    }

    /// Barycentric coordinates of the second and third corner, evenly over a triangle.
    pub fn in_triangle(&mut self) -> (f32, f32) {
        let (u, v) = (self.uniform(), self.uniform());
        if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        }
    }
}

/// Evenly in 0..1, 1 excluded, of anything that has a name: with one seed the same at all times.
pub fn lot(seed: u64, name: &[u32]) -> f32 {
    let drawn = |so_far: u64, word: &u32| {
        let mixed = (so_far ^ u64::from(*word)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ (mixed >> 29)
    };
    Random::new(name.iter().fold(seed, drawn)).uniform()
}
