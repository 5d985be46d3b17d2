//! The checksum of a map in the file that bots navigate by.
//!
//! ioquake3 (`AAS_LoadAASFile`, `Com_BlockChecksum`): the file states the MD4 sum of the whole map, its four words combined by
//! exclusive or. Bots do not load with another map, even if only its light differs.

use support::slice::item;

/// Bytes of the header: ident, version, checksum, and offset and length of 14 lumps.
const HEADER: usize = 12 + 14 * 8;

/// The version whose header, from the checksum on, is combined with i · 119.
const HIDDEN: u32 = 5;
const PLAIN: u32 = 4;

/// Reason why a file of bots cannot be adapted to a map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AasError {
    /// Not such a file, or of an unknown version.
    #[error("not a file of bots' areas of version 4 or 5")]
    Format,
    /// It states the checksum of another map than the original.
    #[error("it belongs to another version of the map")]
    OtherMap,
}

/// The checksum of a map's file.
pub fn checksum(map: &[u8]) -> u32 {
    let [a, b, c, d] = md4(map);
    a ^ b ^ c ^ d
}

/// The file `aas` of the map `original` for the map `relit`, which has the same brushes.
///
/// # Errors
/// [`AasError`].
pub fn adapt(aas: &[u8], original: &[u8], relit: &[u8]) -> Result<Vec<u8>, AasError> {
    let stated = stated(aas).ok_or(AasError::Format)?;
    if stated != checksum(original) {
        return Err(AasError::OtherMap);
    }
    let mut adapted = aas.to_owned();
    let hidden = version(aas) == Some(HIDDEN);
    let sum = mask(checksum(relit).to_le_bytes(), hidden);
    if let Some(place) = adapted.get_mut(8..12) {
        place.copy_from_slice(&sum);
    }
    Ok(adapted)
}

fn version(aas: &[u8]) -> Option<u32> {
    let header = aas.first_chunk::<HEADER>()?;
    let version = u32::from_le_bytes([header[4], header[5], header[6], header[7]]);
    (header.starts_with(b"EAAS") && matches!(version, PLAIN | HIDDEN)).then_some(version)
}

/// The checksum that a file states.
fn stated(aas: &[u8]) -> Option<u32> {
    let hidden = version(aas)? == HIDDEN;
    let bytes: [u8; 4] = aas.get(8..12)?.try_into().ok()?;
    Some(u32::from_le_bytes(mask(bytes, hidden)))
}

fn mask(bytes: [u8; 4], hidden: bool) -> [u8; 4] {
    let mut place = 0u8;
    bytes.map(|byte| {
        let masked = byte ^ place.wrapping_mul(119);
        place += 1;
        if hidden { masked } else { byte }
    })
}

/// RFC 1320.
fn md4(message: &[u8]) -> [u32; 4] {
    let mut state = [0x6745_2301u32, 0xEFCD_AB89, 0x98BA_DCFE, 0x1032_5476];
    let (blocks, rest) = message.as_chunks::<64>();
    blocks.iter().for_each(|block| md4_block(&mut state, block));
    let mut tail = rest.to_vec();
    tail.push(0x80);
    while tail.len() % 64 != 56 {
        tail.push(0);
    }
    tail.extend((message.len() as u64).wrapping_mul(8).to_le_bytes());
    let (blocks, _) = tail.as_chunks::<64>();
    blocks.iter().for_each(|block| md4_block(&mut state, block));
    state
}

fn md4_block(state: &mut [u32; 4], block: &[u8; 64]) {
    const ORDERS: [[usize; 16]; 3] = [
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
        [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15],
        [0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15],
    ];
    const TURNS: [[u32; 4]; 3] = [[3, 7, 11, 19], [3, 5, 9, 13], [3, 9, 11, 15]];
    const ADDED: [u32; 3] = [0, 0x5A82_7999, 0x6ED9_EBA1];
    let words = block.as_chunks::<4>().0;
    let [mut a, mut b, mut c, mut d] = *state;
    for (round, (order, turns)) in ORDERS.iter().zip(&TURNS).enumerate() {
        for (step, &word) in order.iter().enumerate() {
            let mixed = match round {
                0 => (b & c) | (!b & d),
                1 => (b & c) | (b & d) | (c & d),
                _ => b ^ c ^ d,
            };
            let next = a
                .wrapping_add(mixed)
                .wrapping_add(u32::from_le_bytes(item(words, word)))
                .wrapping_add(item(&ADDED, round))
                .rotate_left(item(turns, step % 4));
            (a, b, c, d) = (d, next, b, c);
        }
    }
    for (sum, value) in state.iter_mut().zip([a, b, c, d]) {
        *sum = sum.wrapping_add(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hex(text: &str) -> String {
        let bytes = md4(text.as_bytes()).into_iter().flat_map(u32::to_le_bytes);
        bytes.map(|b| format!("{b:02x}")).collect()
    }

    #[test]
    fn sums_are_those_of_the_standard() {
        assert_eq!(hex(""), "31d6cfe0d16ae931b73c59d7e0c089c0");
        assert_eq!(hex("abc"), "a448017aaf21d8525fc10ae87aa6729d");
        let digits = "1234567890".repeat(8);
        assert_eq!(hex(&digits), "e33b4ddc9c38f2199c3e7b164fcc0536");
    }

    #[test]
    fn a_file_is_adapted_to_the_new_map_and_to_no_other() {
        for version in [PLAIN, HIDDEN] {
            let mut aas = b"EAAS".to_vec();
            aas.extend(version.to_le_bytes());
            let sum = checksum(b"old").to_le_bytes();
            aas.extend(mask(sum, version == HIDDEN));
            aas.resize(HEADER + 20, 7);
            let adapted = adapt(&aas, b"old", b"new").unwrap();
            assert_eq!(stated(&adapted), Some(checksum(b"new")));
            assert_eq!(adapted[12..], aas[12..]);
            assert_eq!(adapt(&aas, b"other", b"new"), Err(AasError::OtherMap));
        }
        assert_eq!(adapt(b"EAAS", b"", b""), Err(AasError::Format));
    }

    #[test]
    fn installed_files_belong_to_their_maps() {
        let Some(folder) = testkit::folder() else {
            return;
        };
        use crate::files::{GameFiles, SearchPath};
        let files = SearchPath::open(&[folder]).unwrap();
        for map in ["oa_dm1", "kaos2", "am_galmevish2"] {
            let read = |end: &str| files.read(&format!("maps/{map}.{end}")).unwrap();
            let (bsp, aas) = (read("bsp").unwrap(), read("aas").unwrap());
            assert_eq!(stated(&aas), Some(checksum(&bsp)), "{map}");
        }
    }
}
