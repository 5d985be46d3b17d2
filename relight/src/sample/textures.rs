//! The images of the sample, computed. All of them repeat without a seam.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use support::parallel;

/// Side of the images of large surfaces, texels.
pub(super) const LARGE: usize = 256;
/// Side of the other images, texels.
pub(super) const SMALL: usize = 128;

/// A colour of a texel, 0 to 1, display-encoded, and its alpha.
pub(super) type Texel = (Vec3, f32);

/// Repeatable number in 0..1 for the cell (x, y).
pub(super) fn grain(x: i32, y: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    (h >> 8) as f32 / (1 << 24) as f32
}

/// Smooth noise in 0..1 with `cells` cells in each direction of the unit square, which repeats.
fn noise(at: Vec2, cells: i32) -> f32 {
    let p = at * cells as f32;
    let (corner, f) = (p.floor(), p - p.floor());
    let f = f * f * (3.0 - 2.0 * f);
    let x = (corner.x as i32).rem_euclid(cells);
    let y = (corner.y as i32).rem_euclid(cells);
    let after = |at: i32| if at + 1 == cells { 0 } else { at + 1 };
    let value = |x: i32, y: i32| grain(x + cells * 71, y);
    let top = value(x, y) + (value(after(x), y) - value(x, y)) * f.x;
    let below = after(y);
    let bottom = value(x, below) + (value(after(x), below) - value(x, below)) * f.x;
    top + (bottom - top) * f.y
}

/// Sum of `octaves` of [`noise`], each of half the size and weight; about 0..1.
pub(super) fn fractal(at: Vec2, cells: i32, octaves: i32) -> f32 {
    let parts = (0..octaves).map(|octave| {
        let weight = 0.5f32.powi(octave);
        (weight, weight * noise(at, cells << octave))
    });
    let (weight, sum) = parts.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    sum / weight
}

/// Veins of marble: 1 along thin lines, 0 elsewhere.
fn veins(at: Vec2, cells: i32) -> f32 {
    let bent = fractal(at, cells, 3) - 0.5;
    (1.0 - bent.abs() * 14.0).max(0.0)
}

/// Brightness of a raised plate that is lit from the upper left, at `at` from its corner; `bevel`: width of its edge.
fn bevel(at: Vec2, size: Vec2, bevel: f32) -> f32 {
    let low = (at / bevel).clamp(Vec2::ZERO, Vec2::ONE);
    let high = ((size - at) / bevel).clamp(Vec2::ZERO, Vec2::ONE);
    1.0 + 0.16 * (2.0 - low.x - low.y) - 0.22 * (2.0 - high.x - high.y)
}

fn rgb(r: u8, g: u8, b: u8) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0
}

/// Courses of blocks: four to the height, two to the width.
fn stone(at: Vec2) -> Texel {
    let course = (at.y * 4.0).floor() as i32;
    let shift = if course % 2 == 0 { 0.0 } else { 0.25 };
    let x = (at.x + shift).rem_euclid(1.0);
    let block = (x * 2.0).floor() as i32;
    let inside =
        Vec2::new(x * 2.0 - block as f32, at.y * 4.0 - course as f32) * Vec2::new(64.0, 32.0);
    let size = Vec2::new(64.0, 32.0);
    let edge = inside.min(size - inside).min_element();
    let own = grain(block + 17, course + 5);
    let rough = fractal(at, 8, 4);
    let tone = 0.72 + 0.16 * own + 0.36 * (rough - 0.5);
    let hue = rgb(196, 176, 150).lerp(rgb(170, 164, 160), grain(course + 3, block + 40));
    if edge < 1.0 {
        return (rgb(92, 84, 76) * (0.8 + 0.4 * rough), 1.0);
    }
    (hue * tone * bevel(inside - 1.0, size - 2.0, 2.5), 1.0)
}

/// Polished slabs, light and dark in turns, with small insets where they meet.
fn floor(at: Vec2) -> Texel {
    let cell = (at * 2.0).floor();
    let inside = (at * 2.0 - cell) * 64.0;
    let edge = inside.min(64.0 - inside);
    let rough = fractal(at, 6, 4);
    if edge.x + edge.y < 9.0 {
        let rim = edge.x + edge.y > 7.6;
        return (
            if rim {
                rgb(58, 50, 44)
            } else {
                rgb(150, 62, 48) * (0.75 + 0.5 * rough)
            },
            1.0,
        );
    }
    if edge.min_element() < 0.5 {
        return (rgb(70, 64, 58), 1.0);
    }
    let light = (cell.x as i32 + cell.y as i32) % 2 == 0;
    let (base, vein) = if light {
        (rgb(206, 194, 172), rgb(150, 132, 112))
    } else {
        (rgb(78, 88, 92), rgb(150, 156, 152))
    };
    let own = 0.92 + 0.12 * grain(cell.x as i32 + 9, cell.y as i32 + 31);
    let color = base.lerp(vein, 0.6 * veins(at + own, 3)) * own * (0.86 + 0.28 * rough);
    (color, 1.0)
}

/// A coffer of a vault: a frame around a blue field with a gilded rosette.
fn coffer(at: Vec2) -> Texel {
    let p = at * 64.0;
    let edge = p.min(64.0 - p).min_element();
    let rough = fractal(at, 8, 4);
    let frame = rgb(206, 186, 150) * (0.82 + 0.3 * rough);
    if edge < 7.0 {
        return (
            frame * bevel(p, Vec2::splat(64.0), 2.0).clamp(0.6, 1.1),
            1.0,
        );
    }
    if edge < 10.0 {
        // the inner faces of the frame: dark where they look away from the light
        let shade = 2.0 - bevel(p - 7.0, Vec2::splat(50.0), 3.0);
        return (frame * shade * 0.72, 1.0);
    }
    let from = p - 32.0;
    let (radius, angle) = (from.length(), from.y.atan2(from.x));
    let petals = 9.0 + 4.0 * (angle * 4.0).cos();
    let field = rgb(40, 66, 96) * (0.75 + 0.5 * rough);
    let gold = rgb(214, 166, 78) * (0.75 + 0.4 * rough);
    let near = (1.0 - (radius - petals).abs() / 1.5)
        .max(0.0)
        .max((1.0 - radius / 4.0) * 3.0);
    (field.lerp(gold, near.clamp(0.0, 1.0)), 1.0)
}

/// Fluted marble: eight flutes to the width.
fn fluted(at: Vec2) -> Texel {
    let flute = (at.x * 8.0).fract();
    let depth = (flute * TAU * 0.5).sin();
    let base = rgb(214, 200, 178).lerp(rgb(160, 138, 118), 0.55 * veins(at, 3));
    let shade = 0.94 - 0.32 * depth * depth - 0.12 * (flute - 0.5);
    (base * shade * (0.88 + 0.24 * fractal(at, 8, 4)), 1.0)
}

/// Plain marble with veins.
fn marble(at: Vec2) -> Texel {
    let base = rgb(210, 198, 180).lerp(rgb(140, 122, 108), 0.7 * veins(at, 2));
    (base * (0.84 + 0.3 * fractal(at, 6, 5)), 1.0)
}

/// Gilded bronze, brushed and worn.
fn bronze(at: Vec2) -> Texel {
    let brushed = noise(Vec2::new(at.x, at.y * 0.0), 64) * 0.2;
    let worn = fractal(at, 6, 4);
    (
        rgb(176, 132, 66).lerp(rgb(84, 66, 48), (worn * 1.4 - 0.3).clamp(0.0, 1.0))
            * (0.9 + brushed),
        1.0,
    )
}

/// Planks of dark wood.
fn wood(at: Vec2) -> Texel {
    let plank = (at.x * 6.0).floor() as i32;
    let inside = (at.x * 6.0).fract();
    let own = grain(plank, 77);
    let fibre = fractal(Vec2::new(at.x * 4.0, (at.y * 0.25 + own).fract()), 8, 4);
    let joint = if !(0.03..0.97).contains(&inside) {
        0.45
    } else {
        1.0
    };
    (
        rgb(122, 80, 48) * (0.55 + 0.3 * own + 0.5 * fibre) * joint,
        1.0,
    )
}

/// Small glazed tiles in greens and blues.
fn mosaic(at: Vec2) -> Texel {
    let cell = (at * 16.0).floor();
    let inside = (at * 16.0 - cell) * 8.0;
    let edge = inside.min(8.0 - inside).min_element();
    if edge < 0.6 {
        return (rgb(120, 124, 118), 1.0);
    }
    let own = grain(cell.x as i32 + 300, cell.y as i32 + 11);
    let base = rgb(52, 128, 134).lerp(rgb(110, 176, 160), own);
    (base * bevel(inside, Vec2::splat(8.0), 1.6), 1.0)
}

/// Bars of iron; the holes between them have alpha 0.
fn grate(at: Vec2) -> Texel {
    let bar = (at * 8.0).fract() * 16.0;
    let solid = bar.x < 4.0 || bar.y < 4.0;
    let round = 1.0 - 0.1 * (bar.min_element() - 2.0).abs();
    (
        rgb(96, 84, 72) * round * (0.8 + 0.4 * fractal(at, 16, 3)),
        f32::from(u8::from(solid)),
    )
}

/// A pane of coloured glass in its lead.
fn pane(color: Vec3) -> impl Fn(Vec2) -> Texel {
    move |at| {
        let edge = at.min(1.0 - at).min_element();
        let lead = if edge < 0.05 { 0.12 } else { 1.0 };
        (color * lead * (0.86 + 0.28 * fractal(at, 4, 3)), 1.0)
    }
}

/// A lamp's glowing screen behind bars.
fn lamp(color: Vec3) -> impl Fn(Vec2) -> Texel {
    move |at| {
        let edge = at.min(1.0 - at).min_element();
        let bar = edge < 0.07 || (at.x - 0.5).abs() < 0.03;
        let glow = 1.0 - 0.5 * (at - 0.5).length();
        (color * if bar { 0.12 } else { glow }, 1.0)
    }
}

/// A round window with petals.
fn rose(at: Vec2) -> Texel {
    let from = (at - 0.5) * 2.0;
    let (radius, angle) = (from.length(), from.y.atan2(from.x));
    let lead = (radius * 3.0).fract() < 0.1
        || ((angle / TAU * 12.0).rem_euclid(1.0) - 0.5).abs() * radius > 0.44 * radius + 0.02
        || radius > 0.97;
    let colors = [rgb(255, 176, 96), rgb(255, 84, 92), rgb(196, 70, 150)];
    let ring = colors
        .get((radius * 3.0) as usize)
        .copied()
        .unwrap_or_default();
    (if lead { rgb(20, 14, 14) } else { ring }, 1.0)
}

/// Ripples of water.
fn water(at: Vec2) -> Texel {
    let ripple = fractal(at, 6, 4);
    (rgb(70, 140, 146) * (0.7 + 0.6 * ripple), 0.28)
}

/// Evening clouds, lit from below.
fn clouds(at: Vec2) -> Texel {
    let clear = rgb(96, 120, 170).lerp(rgb(150, 150, 180), noise(at, 2));
    let cover = ((fractal(at, 3, 5) - 0.42) * 4.0).clamp(0.0, 1.0);
    if cover == 0.0 {
        return (clear, 1.0);
    }
    let lit = rgb(255, 196, 150).lerp(rgb(206, 140, 140), fractal(at, 6, 3));
    (clear.lerp(lit, cover), 1.0)
}

/// Soft reflection of a room for surfaces that shine.
fn sheen(at: Vec2) -> Texel {
    (Vec3::splat(0.3 + 0.1 * (at.y * TAU).cos()), 1.0)
}

/// Faint lights that glass mirrors: windows on either side.
fn gleam(at: Vec2) -> Texel {
    let window = ((at.x * TAU * 2.0).cos() * 2.0 - 1.0).max(0.0) * (at.y * TAU * 0.5).sin();
    (rgb(255, 236, 210) * (0.05 + 0.4 * window * window), 1.0)
}

/// A 32-bit TGA, rows from the bottom as the engine reads them; `texel` is given positions in the unit square from the
/// upper left.
fn tga(side: usize, texel: impl Fn(Vec2) -> Texel) -> Vec<u8> {
    let [low, high] = (side as u16).to_le_bytes();
    let mut bytes = vec![
        0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, low, high, low, high, 32, 8,
    ];
    bytes.reserve(side * side * 4);
    for y in (0..side).rev() {
        for x in 0..side {
            let (color, alpha) = texel((Vec2::new(x as f32, y as f32) + 0.5) / side as f32);
            let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
            bytes.extend([byte(color.z), byte(color.y), byte(color.x), byte(alpha)]);
        }
    }
    bytes
}

/// Colours of the panes of glass, in the order amber, ruby, azure.
pub(super) const GLASS: [Vec3; 3] = [
    Vec3::new(1.0, 0.72, 0.3),
    Vec3::new(0.95, 0.25, 0.28),
    Vec3::new(0.28, 0.66, 0.95),
];

/// Whether the image of the grate is solid at texture coordinates.
pub(super) fn grate_is_solid(st: Vec2) -> bool {
    grate(st - st.floor()).1 > 0.5
}

/// The texel at a place of a texture.
pub(super) type Recipe = Box<dyn Fn(Vec2) -> Texel + Sync>;

/// The images: names, sides, and what shows where.
fn recipes() -> Vec<(&'static str, usize, Recipe)> {
    let [amber, ruby, azure] = GLASS;
    let plain = |color: Vec3, alpha: f32| move |_: Vec2| (color, alpha);
    vec![
        ("stone_image", LARGE, Box::new(stone)),
        ("floor_image", LARGE, Box::new(floor)),
        ("clouds", LARGE, Box::new(clouds)),
        ("coffer", SMALL, Box::new(coffer)),
        ("fluted", SMALL, Box::new(fluted)),
        ("marble", SMALL, Box::new(marble)),
        ("bronze", SMALL, Box::new(bronze)),
        ("wood", SMALL, Box::new(wood)),
        ("mosaic", SMALL, Box::new(mosaic)),
        ("grate_image", SMALL, Box::new(grate)),
        ("water_image", SMALL, Box::new(water)),
        ("lamp_rose", SMALL, Box::new(rose)),
        ("glass_amber", SMALL / 2, Box::new(pane(amber))),
        ("glass_ruby", SMALL / 2, Box::new(pane(ruby))),
        ("glass_azure", SMALL / 2, Box::new(pane(azure))),
        ("lamp_warm", SMALL / 2, Box::new(lamp(rgb(255, 206, 138)))),
        ("lamp_teal", SMALL / 2, Box::new(lamp(rgb(96, 236, 255)))),
        ("sheen", SMALL / 2, Box::new(sheen)),
        ("gleam", SMALL / 2, Box::new(gleam)),
        (
            "crystal_image",
            SMALL / 4,
            Box::new(plain(rgb(196, 226, 226), 0.04)),
        ),
        (
            "mirror_image",
            SMALL / 4,
            Box::new(plain(rgb(44, 50, 56), 0.08)),
        ),
    ]
}

/// The images by path.
pub(super) fn images() -> Vec<(String, Vec<u8>)> {
    images_of("sample", &recipes())
}

/// Images by path, from their names, sides and texels.
pub(super) fn images_of<N: AsRef<str> + Sync>(
    folder: &str,
    recipes: &[(N, usize, Recipe)],
) -> Vec<(String, Vec<u8>)> {
    parallel::map(recipes, |_, (name, side, texel)| {
        let name = name.as_ref();
        (format!("{folder}/{name}.tga"), tga(*side, texel))
    })
}
