//! Targa, as the engine reads it: types 2, 3 and 10, 24 or 32 bits (8 for grey), never a colour map,
//! always bottom row first whatever the descriptor's top-down bit is.
//!
//! Source: Truevision TGA 2.0 specification; the bit's treatment is ioquake3's.

use super::{Fault, Image, check_size, finish, u16_at};

const HEADER: usize = 18;
const TRUE_COLOUR: u8 = 2;
const GREY: u8 = 3;
const TRUE_COLOUR_RLE: u8 = 10;
const TOP_DOWN: u8 = 0x20;

pub(super) fn decode(bytes: &[u8]) -> Result<Image, Fault> {
    let Some(&[id_length, colour_map, kind, ..]) = bytes.first_chunk::<HEADER>() else {
        return Err("TGA header cut short".into());
    };
    let field = |at| u16_at(bytes, at).unwrap_or(0);
    let (width, height) = (u32::from(field(12)), u32::from(field(14)));
    let [bits, descriptor] = field(16).to_le_bytes();
    if !matches!(kind, TRUE_COLOUR | GREY | TRUE_COLOUR_RLE) {
        return Err(Fault::Malformed(format!(
            "TGA type {kind}; only 2, 3 and 10 are read"
        )));
    }
    if colour_map != 0 {
        return Err("TGA with a colour map".into());
    }
    let depth = match bits {
        24 | 32 => usize::from(bits / 8),
        8 if kind == GREY => 1,
        _ => {
            return Err(Fault::Malformed(format!(
                "TGA of type {kind} with {bits} bits per pixel"
            )));
        }
    };
    if descriptor & TOP_DOWN != 0 {
        log::debug!("TGA declares a top-down image; read bottom-up, as the engine does");
    }
    let pixels = check_size(width, height)?;
    let body = bytes
        .get(HEADER + usize::from(id_length)..)
        .ok_or("TGA header cut short")?;
    // Checks the length before allocating the pixels: a run covers at most 128 pixels.
    let least = if kind == TRUE_COLOUR_RLE {
        pixels.div_ceil(128) * (1 + depth)
    } else {
        pixels * depth
    };
    if body.len() < least {
        return Err("TGA cut short".into());
    }
    let mut file_order = Vec::with_capacity(pixels * 4);
    if kind == TRUE_COLOUR_RLE {
        unpack(body, depth, pixels, &mut file_order)?;
    } else {
        for texel in body.chunks_exact(depth).take(pixels) {
            file_order.extend_from_slice(&rgba(texel));
        }
    }
    let row = width as usize * 4;
    let mut top_down = Vec::with_capacity(file_order.len());
    for line in file_order.chunks_exact(row).rev() {
        top_down.extend_from_slice(line);
    }
    finish(width, height, top_down)
}

/// Run-length packets; they may cross the ends of rows.
fn unpack(mut body: &[u8], depth: usize, pixels: usize, out: &mut Vec<u8>) -> Result<(), Fault> {
    let total = pixels * 4;
    while out.len() < total {
        let (&packet, rest) = body.split_first().ok_or("TGA cut short")?;
        let count = usize::from(packet & 0x7f) + 1;
        let wanted = count.min((total - out.len()) / 4);
        let stored = if packet & 0x80 != 0 { 1 } else { count };
        let (data, rest) = rest
            .split_at_checked(stored * depth)
            .ok_or("TGA cut short")?;
        body = rest;
        if packet & 0x80 != 0 {
            let texel = rgba(data);
            for _ in 0..wanted {
                out.extend_from_slice(&texel);
            }
        } else {
            for texel in data.chunks_exact(depth).take(wanted) {
                out.extend_from_slice(&rgba(texel));
            }
        }
    }
    Ok(())
}

/// RGBA of one stored pixel: grey, BGR or BGRA.
fn rgba(texel: &[u8]) -> [u8; 4] {
    match *texel {
        [grey] => [grey, grey, grey, 255],
        [b, g, r] => [r, g, b, 255],
        [b, g, r, a] => [r, g, b, a],
        _ => [0, 0, 0, 255],
    }
}
