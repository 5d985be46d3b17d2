//! Damage to files, and the settings of property tests.

use proptest::test_runner::{Config, FileFailurePersistence};

/// Settings of property tests of so many cases. A seed that fails is kept in `regressions/`, and runs first from then on.
pub fn cases(cases: u32) -> Config {
    let seeds = concat!(env!("CARGO_MANIFEST_DIR"), "/../regressions/proptest.txt");
    Config {
        cases,
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(seeds))),
        ..Config::default()
    }
}

/// Replaces the 32-bit word at each of these offsets of a file by each of these values, and calls `survive`, which
/// returns whether the file was accepted.
///
/// # Panics
/// Few files are accepted, or few are refused: such a test would test nothing.
pub fn poke_words(
    bytes: &[u8],
    offsets: impl Iterator<Item = usize>,
    values: &[i32],
    survive: impl Fn(&[u8]) -> bool,
) {
    let (mut accepted, mut refused) = (0, 0);
    let mut poked = bytes.to_vec();
    for at in offsets {
        for value in values {
            poked[at..at + 4].copy_from_slice(&value.to_le_bytes());
            *(if survive(&poked) {
                &mut accepted
            } else {
                &mut refused
            }) += 1;
        }
        poked[at..at + 4].copy_from_slice(&bytes[at..at + 4]);
    }
    assert!(
        accepted > 100 && refused > 100,
        "{accepted} accepted, {refused} refused"
    );
}
