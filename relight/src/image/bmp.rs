//! Windows bitmaps: uncompressed, 8 bits with a palette, 16 (X1R5G5B5), 24 or 32 bits with alpha.
//!
//! The engine ignores the padding of rows to four bytes, so it shears pictures of odd widths; here rows
//! are padded as in the format if the file is long enough for it. A negative height (top row
//! first) is honoured.
//!
//! Source: Microsoft's BITMAPFILEHEADER and BITMAPINFOHEADER.

use super::{Fault, Image, check_size, finish, u16_at, u32_at};

const HEADER: usize = 54;
const PALETTE: usize = 256 * 4;

pub(super) fn decode(bytes: &[u8]) -> Result<Image, Fault> {
    if bytes.len() < HEADER {
        return Err("BMP header cut short".into());
    }
    if !bytes.starts_with(b"BM") {
        return Err("not a Windows BMP".into());
    }
    let long = |at| u32_at(bytes, at).unwrap_or(0);
    let data_offset = long(10) as usize;
    let info_size = long(14) as usize;
    let width = long(18);
    let signed_height = long(22) as i32;
    let height = signed_height.unsigned_abs();
    let bits = u16_at(bytes, 28).unwrap_or(0);
    let compression = long(30);
    if compression != 0 {
        return Err(Fault::Malformed(format!(
            "BMP with compression {compression}"
        )));
    }
    if !matches!(bits, 8 | 16 | 24 | 32) {
        return Err(Fault::Malformed(format!("BMP with {bits} bits per pixel")));
    }
    let pixels = check_size(width, height)?;
    let palette = if bits == 8 {
        let at = info_size.saturating_add(14);
        // A short palette is allowed to run into the pixels: colours past its end are not used.
        bytes
            .get(at..)
            .map(|p| p.get(..PALETTE).unwrap_or(p))
            .ok_or("BMP palette cut short")?
    } else {
        &[]
    };
    let depth = usize::from(bits / 8);
    let row = width as usize * depth;
    let body = bytes
        .get(data_offset..)
        .ok_or("BMP pixels start past the end of the file")?;
    let padded = row.next_multiple_of(4);
    let stride = if body.len() >= padded * (height as usize - 1) + row {
        padded
    } else {
        row
    };
    if body.len() < stride * (height as usize - 1) + row {
        return Err("BMP cut short".into());
    }
    let mut rgba = Vec::with_capacity(pixels * 4);
    for y in 0..height as usize {
        let stored = if signed_height < 0 {
            y
        } else {
            height as usize - 1 - y
        };
        let line = body
            .get(stored * stride..stored * stride + row)
            .ok_or("BMP cut short")?;
        for texel in line.chunks_exact(depth) {
            rgba.extend_from_slice(&match *texel {
                [index] => {
                    let at = usize::from(index) * 4;
                    match palette.get(at..at + 3) {
                        Some(&[b, g, r]) => [r, g, b, 255],
                        _ => [0, 0, 0, 255],
                    }
                }
                [low, high] => {
                    let packed = u16::from_le_bytes([low, high]);
                    let five = |shift: u32| ((packed >> shift & 31) << 3) as u8;
                    [five(10), five(5), five(0), 255]
                }
                [b, g, r] => [r, g, b, 255],
                [b, g, r, a] => [r, g, b, a],
                _ => [0, 0, 0, 255],
            });
        }
    }
    finish(width, height, rgba)
}
