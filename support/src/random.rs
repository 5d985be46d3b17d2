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

/// Pairs of numbers in the unit square, evenly spread: of 2^k consecutive ones that begin at a multiple of 2^k, one lies
/// in each box of area 2^-k whose sides are powers of two. Sobol's first two dimensions, shuffled and scrambled (Burley,
/// Practical Hash-based Owen Scrambling, JCGT 9(4), 2020), as `shaders/trace/random.glsl` has them.
#[derive(Debug, Clone, Copy)]
pub struct Pairs {
    /// Of the order, and of each dimension.
    seeds: [u32; 3],
}

impl Pairs {
    /// A sequence of its own for every seed.
    pub fn new(seed: u64) -> Pairs {
        let mut random = Random::new(seed);
        Pairs {
            seeds: [random.bits(), random.bits(), random.bits()],
        }
    }

    /// A pair of the sequence; 1 is excluded.
    pub fn at(&self, index: u32) -> [f32; 2] {
        let [order, first, second] = self.seeds;
        let index = scramble(index.reverse_bits(), order).reverse_bits();
        let unit = |bits: u32| (bits.reverse_bits() >> 8) as f32 / (1u32 << 24) as f32;
        [
            unit(scramble(index, first)),
            unit(scramble(sobol_second(index), second)),
        ]
    }
}

/// Owen scrambling of a number with reversed bits: whether a bit flips depends on the bits below it.
fn scramble(reversed: u32, seed: u32) -> u32 {
    let mut bits = reversed ^ reversed.wrapping_mul(0x3D20_ADEA);
    bits = bits.wrapping_add(seed).wrapping_mul(seed >> 16 | 1);
    bits ^= bits.wrapping_mul(0x0552_6C56);
    bits ^ bits.wrapping_mul(0x53A2_2864)
}

/// Sobol's second dimension of an index, with reversed bits.
fn sobol_second(index: u32) -> u32 {
    let mut bits = index ^ index >> 16;
    bits ^= (bits & 0xFF00_FF00) >> 8;
    bits ^= (bits & 0xF0F0_F0F0) >> 4;
    bits ^= (bits & 0xCCCC_CCCC) >> 2;
    bits ^ (bits & 0xAAAA_AAAA) >> 1
}

/// Uniform number in [0, 1) from the hash of a seed and an identity.
pub fn hashed_uniform(seed: u64, name: &[u32]) -> f32 {
    let drawn = |so_far: u64, word: &u32| {
        let mixed = (so_far ^ u64::from(*word)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ (mixed >> 29)
    };
    Random::new(name.iter().fold(seed, drawn)).uniform()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_lie_one_in_each_box() {
        let mut firsts = Vec::new();
        for seed in 0..20 {
            let pairs = Pairs::new(seed);
            for begin in [0, 16, 48] {
                let some: Vec<[f32; 2]> = (begin..begin + 16).map(|i| pairs.at(i)).collect();
                for power in 0..=4 {
                    let (columns, rows) = (1u32 << power, 16u32 >> power);
                    let place = |p: &[f32; 2]| {
                        (p[0] * columns as f32) as u32 * rows + (p[1] * rows as f32) as u32
                    };
                    let mut boxes: Vec<u32> = some.iter().map(place).collect();
                    boxes.sort_unstable();
                    assert!(boxes.into_iter().eq(0..16), "{seed} {begin} {columns}");
                }
            }
            firsts.push(pairs.at(0).map(f32::to_bits));
        }
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), 20);
    }
}
