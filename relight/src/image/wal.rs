//! WAL, the textures of Quake II: a header of 100 bytes, then palette indices in four sizes, the largest first. The
//! palette is the game's, at the end of `pics/colormap.pcx`.

use super::{Fault, Image, check_size, finish, u32_at};

/// Game path of the picture whose palette all textures use.
pub(super) const PALETTE_FILE: &str = "pics/colormap.pcx";

/// Bytes of a palette: 256 × RGB.
const PALETTE: usize = 768;

/// The palette at the end of a PCX file.
pub(super) fn palette_of_pcx(bytes: &[u8]) -> Option<&[u8]> {
    bytes.get(bytes.len().checked_sub(PALETTE)?..)
}

/// Width and height.
pub(super) fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    Some((u32_at(bytes, 32)?, u32_at(bytes, 36)?))
}

pub(super) fn decode(bytes: &[u8], palette: &[u8]) -> Result<Image, Fault> {
    let (Some((width, height)), Some(offset)) = (size(bytes), u32_at(bytes, 40)) else {
        return Err("WAL header cut short".into());
    };
    let pixels = check_size(width, height)?;
    let start = usize::try_from(offset).unwrap_or(usize::MAX);
    let indices = bytes
        .get(start..start.saturating_add(pixels))
        .ok_or("WAL cut short")?;
    let entries = palette.as_chunks::<3>().0;
    let rgba = indices.iter().flat_map(|&index| {
        let [r, g, b] = entries
            .get(usize::from(index))
            .copied()
            .unwrap_or([index; 3]);
        [r, g, b, 255]
    });
    finish(width, height, rgba.collect())
}
