//! Pictures in which orientation, scale, alpha and mip level show. All scenes have them, under `g/`.

use super::File;
use crate::maps::tga;

/// An uncompressed TGA with alpha, rows from the bottom; `pixel` counts rows from the top.
pub fn tga_with_alpha(width: u16, height: u16, pixel: impl Fn(u16, u16) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([32, 8]);
    for y in (0..height).rev() {
        for x in 0..width {
            let [r, g, b, a] = pixel(x, y);
            bytes.extend([b, g, r, a]);
        }
    }
    bytes
}

/// A square of `n` pixels in which every orientation shows: four different quarters, a diagonal, a bright upper edge.
fn orientation(n: u16, x: u16, y: u16) -> [u8; 3] {
    let half = n / 2;
    if y < n / 16 {
        return [255, 255, 255];
    }
    if x.abs_diff(y) <= n / 32 {
        return [20, 20, 20];
    }
    match (x < half, y < half) {
        (true, true) => [220, 60, 50],
        (false, true) => [60, 200, 70],
        (true, false) => [60, 80, 220],
        (false, false) => [200, 190, 60],
    }
}

/// The digit `n` as a pattern: `n + 1` bars.
fn bars(n: u16, x: u16, y: u16) -> [u8; 3] {
    let bar = x / 4;
    if bar.is_multiple_of(2) && bar / 2 <= n && (8..24).contains(&y) {
        [255, 240, 80]
    } else {
        [(n * 30) as u8, 40, 90]
    }
}

/// The files.
///
/// * `g/base`: 64 pixels, orientation;
/// * `g/alpha`: the same with alpha from 0 at the left to 255 at the right;
/// * `g/cut`: a disc, alpha 255 inside and 0 outside, soft by 4 pixels;
/// * `g/grey`: a ramp from black at the left to white at the right, 256 wide;
/// * `g/fine`: 256 pixels, a checkerboard of single pixels: shows the mip level;
/// * `g/env`: smooth, for environment coordinates;
/// * `g/wide`: 128x32, orientation;
/// * `g/frame0` to `g/frame9`: bars to count;
/// * `g/white`, `g/black`, `g/half`: one colour;
/// * `g/wall`: a quiet checkerboard;
/// * `gfx/2d/bigchars`: characters, 16 in a row, each a pattern of its code's bits.
pub fn files() -> Vec<File> {
    let disc = |x: u16, y: u16| {
        let (dx, dy) = (f32::from(x) - 31.5, f32::from(y) - 31.5);
        let inside = 28.0 - dx.hypot(dy);
        (inside / 4.0 * 255.0).clamp(0.0, 255.0) as u8
    };
    let with = |[r, g, b]: [u8; 3], a: u8| [r, g, b, a];
    let smooth = |x: u16, y: u16| {
        let wave = |v: f32, turns: f32| {
            (128.0 + 110.0 * (v / 128.0 * turns * std::f32::consts::TAU).sin()) as u8
        };
        let (x, y) = (f32::from(x), f32::from(y));
        [wave(x, 1.0), wave(y, 2.0), wave(x + y, 1.0)]
    };
    let letters = |x: u16, y: u16| {
        let code = y / 16 * 16 + x / 16;
        let (bit, row) = (x % 16 / 2, y % 16 / 2);
        let on = bit < 7 && row < 7 && (code >> bit & 1 == 1 || row == 0);
        [255, 255, 255, if on { 255 } else { 0 }]
    };
    let mut files = vec![
        ("g/base", tga(64, 64, |x, y| orientation(64, x, y))),
        (
            "g/alpha",
            tga_with_alpha(64, 64, |x, y| {
                with(orientation(64, x, y), (x * 255 / 63) as u8)
            }),
        ),
        (
            "g/cut",
            tga_with_alpha(64, 64, |x, y| with(orientation(64, x, y), disc(x, y))),
        ),
        ("g/grey", tga(256, 8, |x, _| [x as u8; 3])),
        (
            "g/fine",
            tga(256, 256, |x, y| {
                if (x + y) % 2 == 0 {
                    [255, 255, 0]
                } else {
                    [0, 0, 255]
                }
            }),
        ),
        ("g/env", tga(128, 128, smooth)),
        ("g/wide", tga(128, 32, |x, y| orientation(128, x, y * 4))),
        ("g/white", tga(8, 8, |_, _| [255; 3])),
        ("g/black", tga(8, 8, |_, _| [0; 3])),
        ("g/half", tga(8, 8, |_, _| [128; 3])),
        (
            "g/wall",
            tga(32, 32, |x, y| {
                if (x / 8 + y / 8) % 2 == 0 {
                    [110, 100, 90]
                } else {
                    [70, 75, 85]
                }
            }),
        ),
        ("gfx/2d/bigchars", tga_with_alpha(256, 256, letters)),
    ]
    .into_iter()
    .map(|(name, bytes)| (format!("{name}.tga"), bytes))
    .collect::<Vec<_>>();
    for n in 0..10 {
        files.push((format!("g/frame{n}.tga"), tga(32, 32, |x, y| bars(n, x, y))));
    }
    files
}
