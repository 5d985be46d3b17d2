//! The driver's pipeline cache as bytes for a file.

/// Magic number of a saved pipeline cache, with the format version.
const CACHE_MAGIC: &[u8; 8] = b"RLPCACH1";

/// FNV-1a.
pub fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// A driver's cache after magic number and hash: drivers check the origin of a cache, not its integrity.
pub(crate) fn cache_to_bytes(data: &[u8]) -> Vec<u8> {
    let mut bytes = CACHE_MAGIC.to_vec();
    bytes.extend(hash(data).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// The driver's part of a saved cache, if it is intact.
pub(crate) fn cache_from_bytes(bytes: &[u8]) -> Option<&[u8]> {
    let rest = bytes.strip_prefix(CACHE_MAGIC)?;
    let (sum, data) = rest.split_at_checked(8)?;
    (sum == hash(data).to_le_bytes()).then_some(data)
}

/// Whether bytes are an intact cache of [`Device::pipeline_cache_data`](super::Device::pipeline_cache_data). The driver
/// checks its origin.
pub fn is_pipeline_cache(bytes: &[u8]) -> bool {
    cache_from_bytes(bytes).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_pipeline_cache_is_not_given_to_the_driver() {
        let good = cache_to_bytes(&[1, 2, 3, 4]);
        assert_eq!(cache_from_bytes(&good), Some(&[1u8, 2, 3, 4][..]));
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x40;
            assert_eq!(cache_from_bytes(&bad), None, "byte {at}");
            assert_eq!(cache_from_bytes(&good[..at]), None, "cut at {at}");
        }
    }
}
