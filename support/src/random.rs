//! A small random generator, so that one map gives one result everywhere.

use glam::Vec3;

/// PCG-like: the high bits of a 64-bit linear congruential generator, mixed.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator of its own for every seed.
    pub fn new(seed: u64) -> Random {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03);
        random.uniform();
        random
    }

    /// 32 bits, evenly.
    pub fn bits(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ (self.0 >> 22)) >> 29;
        (mixed & 0xFFFF_FFFF) as u32
    }

    /// Evenly in 0..1, 1 excluded.
    pub fn uniform(&mut self) -> f32 {
        (self.bits() & 0xFF_FFFF) as f32 / (1u32 << 24) as f32
    }

    /// Evenly in -1..1, 1 excluded.
    pub fn signed(&mut self) -> f32 {
        self.uniform() * 2.0 - 1.0
    }

    /// Each coordinate evenly in -1..1, 1 excluded.
    pub fn signed_point(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// That many bytes, evenly.
    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.bits() as u8).collect()
    }

    /// An index below `count`, which must be less than 2^32; 0 if `count` is 0.
    pub fn below(&mut self, count: usize) -> usize {
        self.bits() as usize % count.max(1)
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

/// Uniform number in [0, 1) from the hash of a seed and an identity.
pub fn hashed_uniform(seed: u64, name: &[u32]) -> f32 {
    let drawn = |so_far: u64, word: &u32| {
        let mixed = (so_far ^ u64::from(*word)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ (mixed >> 29)
    };
    Random::new(name.iter().fold(seed, drawn)).uniform()
}
