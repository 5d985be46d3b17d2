//! The checksum of a map in the file that bots navigate by.
//!
//! ioquake3 (`AAS_LoadAASFile`, `Com_BlockChecksum`): the file states the MD4 sum of the whole map, its four words combined by
//! exclusive or. Bots do not load with another map, even if only its light differs.

use md4::{Digest, Md4};

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
    let sum = Md4::digest(map);
    let words = sum.as_chunks::<4>().0.iter();
    words.fold(0, |all, word| all ^ u32::from_le_bytes(*word))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_engine() {
        // RFC 1320: a448017a af21d852 5fc10ae8 7aa6729d, words from the low byte
        assert_eq!(checksum(b"abc"), 0x5da10e2e);
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
