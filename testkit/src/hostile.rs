//! Damage to files.

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
