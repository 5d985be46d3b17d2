//! The second sample: a room of surfaces that reflect in different ways, lit by lamps alone. Two rows of balls vary
//! roughness, of plastic and of metal; behind them a wall of bricks has maps beside its image, the floor is wet stone with
//! a map of roughness, and two panes are clear and frosted glass.

use glam::{Vec2, Vec3};
use q3bsp::{Bsp, ShaderId, content_flags};

use super::furniture::lamp;
use super::light::{DARK, Lighting};
use super::scene::{Scene, add_places, face};
use super::textures::{Recipe, Texel, fractal, grain, images_of};

/// Game path of the map.
pub(super) const MAP: &str = "maps/surfaces.bsp";
/// Its script, and what states how its surfaces reflect.
pub(super) const TEXTS: [(&str, &str); 2] = [
    ("scripts/surfaces.shader", include_str!("surfaces.shader")),
    (
        "maps/surfaces.materials",
        include_str!("surfaces.materials"),
    ),
];

/// Half of the room's length and width, and its height.
const ROOM: Vec3 = Vec3::new(288.0, 240.0, 208.0);
/// Radius of the balls, their distance, and how many there are in a row.
const BALL: f32 = 26.0;
const STEP: f32 = 72.0;
const BALLS: usize = 5;
/// Where the rows stand: y, and height of their plinths.
const PLASTIC: (f32, f32) = (40.0, 14.0);
const METAL: (f32, f32) = (134.0, 66.0);
/// Values and colours of the lamps, as in the script.
const LAMP: (f32, Vec3) = (8000.0, Vec3::new(1.0, 0.96, 0.88));
const WARM: (f32, Vec3) = (9000.0, Vec3::new(1.0, 0.72, 0.42));

/// Where the camera and the players begin.
const PLACES: [(&str, &str, &str); 5] = [
    ("info_player_intermission", "0 -226 112", "10 90 0"),
    ("info_player_deathmatch", "0 -150 24", "0 90 0"),
    ("info_player_deathmatch", "-240 -150 24", "0 45 0"),
    ("info_player_deathmatch", "240 -150 24", "0 135 0"),
    ("info_player_deathmatch", "0 -90 24", "0 90 0"),
];

/// Distance of the points of the light grid.
const GRID: Vec3 = Vec3::splat(64.0);

pub(super) fn build_map() -> Bsp {
    let mut scene = Scene::new();
    let mut add = |name: &str, content: u32| {
        scene
            .map
            .add_shader(&format!("surfaces/{name}"), 0, content)
    };
    let solid = content_flags::SOLID;
    let [plaster, brick, floor, lamp_white, lamp_warm] =
        ["plaster", "brick", "floor", "lamp_white", "lamp_warm"].map(|name| add(name, solid));
    let [clear, frosted] = ["clear", "frosted"].map(|name| add(name, 0));
    let balls =
        ["plastic", "metal"].map(|name| [0, 1, 2, 3, 4].map(|i| add(&format!("{name}{i}"), 0)));
    room(&mut scene, [plaster, brick, floor]);
    let mut lamps = Vec::new();
    for x in [-150.0, 0.0, 150.0] {
        let sides = [
            Vec3::new(x, -40.0, ROOM.z - 2.0),
            Vec3::Y * 14.0,
            Vec3::X * 44.0,
        ];
        lamp(&mut scene, &mut lamps, (lamp_white, LAMP), sides, [2, 6]);
    }
    let small = [
        Vec3::new(-200.0, 2.0 - ROOM.y, 132.0),
        Vec3::NEG_X * 12.0,
        Vec3::Z * 26.0,
    ];
    lamp(&mut scene, &mut lamps, (lamp_warm, WARM), small, [2, 4]);
    for (row, (y, height)) in balls.into_iter().zip([PLASTIC, METAL]) {
        let half = Vec3::new(STEP * 0.5 * BALLS as f32, BALL + 8.0, 0.0);
        let foot = Vec3::Y * y;
        let (mins, maxs) = (foot - half, foot + half + Vec3::Z * height);
        scene.block(plaster, mins, maxs, face::SIDES | face::ABOVE);
        for (index, shader) in row.into_iter().enumerate() {
            let x = (index as f32 - 0.5 * (BALLS - 1) as f32) * STEP;
            scene.ball(shader, Vec3::new(x, y, height + BALL), BALL);
        }
    }
    for (shader, x) in [(clear, -150.0), (frosted, 150.0)] {
        pane(&mut scene, shader, Vec3::new(x, -14.0, 0.0));
    }
    scene.pack();
    let Scene { mut map, places } = scene;
    map.set_world_key("message", "Relight surfaces");
    add_places(&mut map, &PLACES);
    map.add_cell((-ROOM).with_z(0.0), ROOM);
    let mut bsp = map.build_with_grid(GRID, |_| DARK);
    let passed = [clear, frosted, lamp_white, lamp_warm];
    let stops: Vec<bool> = (bsp.surfaces.iter())
        .map(|surface| !passed.contains(&surface.shader))
        .collect();
    let lighting = Lighting::new(&bsp, &lamps, false, |surface| {
        stops.get(surface) == Some(&true)
    });
    lighting.store(&mut bsp, &places);
    bsp
}

/// Walls, floor and ceiling with their brushes.
fn room(scene: &mut Scene, [plaster, brick, floor]: [ShaderId; 3]) {
    let [x, y, z] = [Vec3::X * ROOM.x, Vec3::Y * ROOM.y, Vec3::Z * (ROOM.z * 0.5)];
    for (shader, out, right, up) in [
        (floor, -z, x, y),
        (plaster, z, y, x),
        (brick, y, x, z),
        (plaster, -y, -x, z),
        (plaster, x, -y, z),
        (plaster, -x, y, z),
    ] {
        scene.plate(shader, z + out, right, up, true);
        let half = x + y + z - out.abs();
        let thick = out.normalize_or_zero() * 8.0;
        let middle = z + out + thick;
        let half = half + thick.abs();
        scene
            .map
            .add_box_brush(shader, middle - half, middle + half);
    }
}

/// An upright pane.
fn pane(scene: &mut Scene, shader: ShaderId, foot: Vec3) {
    let (wide, tall) = (38.0, 40.0);
    let middle = foot + Vec3::Z * (tall + 6.0);
    let surface = scene.plate(shader, middle, Vec3::X * wide, Vec3::Z * tall, false);
    scene.whole_image(surface);
}

fn rgb(r: u8, g: u8, b: u8) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0
}

/// Place in a brick (0 to 1 in both directions), and the brick's own number; courses of eight bricks' height.
fn brick_at(at: Vec2) -> (Vec2, f32) {
    let course = (at.y * 8.0).floor() as i32;
    let shift = if course % 2 == 0 { 0.0 } else { 0.125 };
    let x = (at.x + shift).rem_euclid(1.0) * 4.0;
    let inside = Vec2::new(x.fract(), (at.y * 8.0).fract());
    (inside, grain(x as i32 + 3, course + 11))
}

/// Height of the wall of bricks, about 0 to 1.
fn brick_height(at: Vec2) -> f32 {
    let (inside, own) = brick_at(at);
    let edge = inside.min(Vec2::ONE - inside) * Vec2::new(2.0, 1.0);
    let body = ((edge.min_element() - 0.06) / 0.1).clamp(0.0, 1.0);
    let smooth = body * body * (3.0 - 2.0 * body);
    smooth * (0.7 + 0.2 * own) + 0.16 * fractal(at, 16, 3)
}

fn brick(at: Vec2) -> Texel {
    let (_, own) = brick_at(at);
    let mortar = brick_height(at) < 0.3;
    let tone = 0.8 + 0.3 * (fractal(at, 12, 4) - 0.5);
    let body = rgb(168, 84, 62).lerp(rgb(132, 70, 60), own);
    let color = if mortar { rgb(150, 144, 134) } else { body };
    (color * tone, 1.0)
}

/// Reflectance and smoothness of the bricks: they are glazed, the mortar is dull.
fn brick_gloss(at: Vec2) -> Texel {
    let glazed = ((brick_height(at) - 0.35) / 0.3).clamp(0.0, 1.0);
    // display-encoded 0.22 is 4 %
    (
        Vec3::splat(0.22 * (0.3 + 0.7 * glazed)),
        0.15 + 0.6 * glazed,
    )
}

/// Height of the floor: slabs with worn middles.
fn floor_height(at: Vec2) -> f32 {
    let inside = (at * 4.0).fract_gl();
    let edge = inside.min(Vec2::ONE - inside).min_element();
    let slab = ((edge - 0.02) / 0.05).clamp(0.0, 1.0);
    slab * 0.5 + 0.5 * fractal(at, 6, 4)
}

/// 1 where water stands on the floor, 0 where it is dry.
fn wet(at: Vec2) -> f32 {
    ((fractal(at + 0.37, 3, 3) - 0.44) / 0.1).clamp(0.0, 1.0)
}

fn floor(at: Vec2) -> Texel {
    let slab = (at * 4.0).floor();
    let tone = 0.85
        + 0.2 * (grain(slab.x as i32 + 5, slab.y as i32) - 0.5)
        + 0.4 * (fractal(at, 10, 4) - 0.5);
    // water fills the pores, which darkens stone
    (rgb(126, 122, 116) * tone * (1.0 - 0.35 * wet(at)), 1.0)
}

/// Roughness (green) and metal (blue) of the floor.
fn floor_roughness(at: Vec2) -> Texel {
    (Vec3::new(1.0, 0.8 - 0.73 * wet(at), 0.0), 1.0)
}

/// Direction of the second component of a normal map in its image.
#[derive(Clone, Copy)]
enum Second {
    /// Up, as files of materials have it.
    Up,
    /// Down, as `opengl2` has it.
    Down,
}

/// The normals of a height that repeats; `scale`: height of 1 in widths of the image.
fn normals(
    height: impl Fn(Vec2) -> f32 + Sync,
    scale: f32,
    second: Second,
) -> impl Fn(Vec2) -> Texel + Sync {
    move |at| {
        const STEP: f32 = 1.0 / 512.0;
        let of = |x: f32, y: f32| height((at + Vec2::new(x, y)).fract_gl());
        let x = (of(STEP, 0.0) - of(-STEP, 0.0)) * scale / (2.0 * STEP);
        let y = (of(0.0, STEP) - of(0.0, -STEP)) * scale / (2.0 * STEP);
        // rows count downwards
        let y = match second {
            Second::Up => y,
            Second::Down => -y,
        };
        (Vec3::new(-x, y, 1.0).normalize_or_zero() * 0.5 + 0.5, 1.0)
    }
}

/// The images by path.
pub(super) fn images() -> Vec<(String, Vec<u8>)> {
    let plain = |color: Vec3, alpha: f32| -> Recipe { Box::new(move |_: Vec2| (color, alpha)) };
    let mut all: Vec<(String, usize, Recipe)> = Vec::new();
    let mut add =
        |name: &str, side: usize, recipe: Recipe| all.push((name.to_owned(), side, recipe));
    add("brick", 128, Box::new(brick));
    add(
        "brick_n",
        128,
        Box::new(normals(brick_height, 0.018, Second::Down)),
    );
    add("brick_s", 128, Box::new(brick_gloss));
    add("floor", 128, Box::new(floor));
    add(
        "floor_normals",
        128,
        Box::new(normals(
            |at| floor_height(at) * (1.0 - 0.9 * wet(at)),
            0.012,
            Second::Up,
        )),
    );
    add("floor_surface", 128, Box::new(floor_roughness));
    add("plaster", 4, plain(rgb(178, 176, 170), 1.0));
    add("lamp_white", 4, plain(rgb(255, 250, 240), 1.0));
    add("lamp_warm", 4, plain(rgb(255, 220, 170), 1.0));
    add("pane", 4, plain(rgb(200, 220, 220), 0.1));
    for index in 0..BALLS {
        add(&format!("plastic{index}"), 4, plain(rgb(170, 36, 30), 1.0));
        add(&format!("metal{index}"), 4, plain(rgb(255, 217, 145), 1.0));
    }
    images_of("surfaces", &all)
}
