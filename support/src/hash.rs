//! A 128-bit hash, for the names of results that are kept.

use glam::Vec3;

/// Two 64-bit lanes of multiply and rotate. It guards against chance collisions, not against an adversary: who can write
/// the folder of kept results can write anything into it.
#[derive(Debug, Clone)]
pub struct Hash(u64, u64);

impl Default for Hash {
    fn default() -> Hash {
        Hash::new()
    }
}

impl Hash {
    /// The hash of nothing.
    pub fn new() -> Hash {
        Hash(0xCBF2_9CE4_8422_2325, 0x9E37_79B9_7F4A_7C15)
    }

    /// Adds a number.
    pub fn number(&mut self, number: u64) {
        self.0 = (self.0 ^ number).wrapping_mul(0x0000_0100_0000_01B3);
        self.0 ^= self.0 >> 29;
        self.1 = (self.1.rotate_left(23) ^ number).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    }

    /// Adds the bits of three coordinates.
    pub fn vector(&mut self, v: Vec3) {
        let [x, y, z] = v.to_array().map(|c| u64::from(c.to_bits()));
        self.number(x << 32 | y);
        self.number(z);
    }

    /// Adds bytes and their number.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        let (whole, rest) = bytes.as_chunks::<8>();
        whole
            .iter()
            .for_each(|b| self.number(u64::from_le_bytes(*b)));
        rest.iter().for_each(|b| self.number(u64::from(*b)));
    }

    /// The hash of all that was added.
    pub fn finish(mut self) -> u128 {
        self.number(0x5851_F42D_4C95_7F2D);
        u128::from(self.0) << 64 | u128::from(self.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_and_its_order_counts() {
        let of = |parts: &[&[u8]]| {
            let mut hash = Hash::new();
            parts.iter().for_each(|part| hash.bytes(part));
            hash.finish()
        };
        let hashes = [
            of(&[]),
            of(&[b""]),
            of(&[b"ab"]),
            of(&[b"a", b"b"]),
            of(&[b"b", b"a"]),
            of(&[b"123456789"]),
            of(&[b"123456780"]),
        ];
        for (i, a) in hashes.iter().enumerate() {
            assert!(hashes.iter().skip(i + 1).all(|b| a != b), "{i}");
        }
    }

    #[test]
    fn kept_results_keep_their_names() {
        // files of earlier versions are found by these: a change makes every result anew
        let mut hash = Hash::new();
        hash.number(7);
        hash.vector(Vec3::new(1.0, -2.0, 0.5));
        hash.bytes(b"relight light");
        assert_eq!(hash.finish(), EXPECTED);
    }

    const EXPECTED: u128 = 78_835_006_073_160_648_860_673_212_174_591_751_906;
}
