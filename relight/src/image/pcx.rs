//! PCX, version 5: 8 bits, one plane, run-length coded, palette in the last 769 bytes.
//!
//! As in the engine, runs fill the picture without regard to `bytes_per_line`, and the upper left
//! corner is taken to be the origin.
//!
//! Source: ZSoft PCX technical reference; the simplifications are the engine's.

use super::{Fault, Image, check_size, finish, u16_at};

const HEADER: usize = 128;
const PALETTE: usize = 768;
const PALETTE_MARK: u8 = 0x0c;

pub(super) fn decode(bytes: &[u8]) -> Result<Image, Fault> {
    let Some(&[maker, version, encoding, bits, ..]) = bytes.first_chunk::<HEADER>() else {
        return Err("PCX header cut short".into());
    };
    let planes = bytes.get(65).copied().unwrap_or(0);
    if (maker, version, encoding, bits, planes) != (0x0a, 5, 1, 8, 1) {
        return Err("PCX other than 8-bit version 5".into());
    }
    let side = |at| u32::from(u16_at(bytes, at).unwrap_or(0)) + 1;
    let (width, height) = (side(8), side(10));
    let pixels = check_size(width, height)?;
    let mark = bytes
        .len()
        .checked_sub(PALETTE + 1)
        .filter(|&at| at >= HEADER)
        .ok_or("PCX without a palette")?;
    let (body, tail) = bytes.split_at(mark);
    let palette = match tail.split_first() {
        Some((&PALETTE_MARK, palette)) => palette,
        _ => return Err("PCX without a palette".into()),
    };
    // A file shorter than its header is refused as cut short.
    let mut body = body.get(HEADER..).unwrap_or_default().iter();
    if body.len().saturating_mul(63) < pixels {
        return Err("PCX cut short".into());
    }
    let mut rgba = Vec::with_capacity(pixels * 4);
    while rgba.len() < pixels * 4 {
        let first = *body.next().ok_or("PCX cut short")?;
        let (run, index) = match first {
            0xc0.. => (
                usize::from(first & 0x3f),
                *body.next().ok_or("PCX cut short")?,
            ),
            _ => (1, first),
        };
        let at = usize::from(index) * 3;
        let colour = match palette.get(at..at + 3) {
            Some(&[r, g, b]) => [r, g, b, 255],
            _ => [0, 0, 0, 255],
        };
        for _ in 0..run.min(pixels - rgba.len() / 4) {
            rgba.extend_from_slice(&colour);
        }
    }
    finish(width, height, rgba)
}
