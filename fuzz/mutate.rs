//! Seeds and changes of them, for the tests that run the functions of the fuzz targets without a fuzzer.

use std::path::Path;

/// 32-bit values that break counts, offsets, indices and floats.
const WORDS: [u32; 8] = [
    0,
    1,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0xffff,
    1000,
    0x7fc0_0000,
];

/// The seeds of a target, by name.
pub fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz/seeds")
        .join(target);
    let entries = std::fs::read_dir(&folder).expect("the folder of seeds");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a seed").path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} is empty", folder.display());
    let read = |path| std::fs::read(path).expect("a seed can be read");
    paths.into_iter().map(read).collect()
}

/// Xorshift (Marsaglia 2003), so that a failure can be repeated.
struct Random(u64);

impl Random {
    /// A number below `limit`, 0 when that is 0.
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % limit.max(1)
    }
}

/// Changes a few places of `bytes`; `other` is a seed that parts are taken from.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len());
        let end = bytes.len().min(at + 1 + random.below(64));
        match random.below(6) {
            0 | 1 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.below(256) as u8;
                }
            }
            2 | 3 => {
                let word = WORDS[random.below(WORDS.len())].to_le_bytes();
                let at = at / 4 * 4;
                if let Some(slot) = bytes.get_mut(at..at + 4) {
                    slot.copy_from_slice(&word);
                }
            }
            4 => {
                let from = random.below(other.len());
                let part = &other[from..other.len().min(from + end - at)];
                bytes.splice(at..end, part.iter().copied());
            }
            _ => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
        }
    }
}

/// Gives `visit` each seed, 200 truncations and `count` mutations of each. Returns how many of the mutations it took
/// and refused. Every seed has to be taken.
pub fn run(target: &str, count: usize, visit: impl Fn(&[u8]) -> bool) -> (usize, usize) {
    let seeds = seeds(target);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut taken, mut refused) = (0, 0);
    for seed in &seeds {
        assert!(visit(seed), "a seed of {target} is refused");
        for part in 0..200 {
            visit(&seed[..seed.len() * part / 200]);
        }
        for _ in 0..count {
            let mut bytes = seed.clone();
            mutate(&mut bytes, &seeds[random.below(seeds.len())], &mut random);
            match visit(&bytes) {
                true => taken += 1,
                false => refused += 1,
            }
        }
    }
    (taken, refused)
}
