//! What stands and hangs in the sample's hall: the pool with its lamps, a ball of crystal, a mirror, lanterns and a
//! round window.

use glam::{Vec2, Vec3};

use super::Shaders;
use super::light::Lamp;
use super::plan::*;
use super::scene::{Scene, face};
use super::windows;

/// Middle of the mirror, and half of its size.
pub(super) const MIRROR: (Vec3, Vec2) = (Vec3::new(-16.0, 214.0, 96.0), Vec2::new(62.0, 80.0));
/// Which way the mirror looks: at what is behind and to the right of the first view.
pub(super) const MIRROR_NORMAL: Vec3 = Vec3::new(-0.8, -0.6, 0.0);

/// Lanterns: where they hang, and from where.
const LANTERNS: [(Vec3, f32); 5] = [
    (Vec3::new(-337.5, 144.0, 150.0), 228.0),
    (Vec3::new(-337.5, -144.0, 150.0), 228.0),
    (Vec3::new(-112.5, 144.0, 150.0), 228.0),
    (Vec3::new(337.5, 144.0, 150.0), 228.0),
    (Vec3::new(337.5, -144.0, 150.0), 228.0),
];

/// Values and colours of the lamps, as in the script.
const WARM: (f32, Vec3) = (7000.0, Vec3::new(1.0, 0.62, 0.28));
const TEAL: (f32, Vec3) = (2000.0, Vec3::new(0.12, 0.85, 1.0));
const ROSE: (f32, Vec3) = (700.0, Vec3::new(1.0, 0.45, 0.3));
/// The sky of the script, as a surface of that value: half of it comes through coloured glass.
const SKY: (f32, Vec3) = (30.0, Vec3::new(0.85, 0.85, 1.0));

/// Adds a lamp: a plate, and parts along and across it for the stored light.
pub(super) fn lamp(
    scene: &mut Scene,
    lamps: &mut Vec<Lamp>,
    (shader, light): (q3bsp::ShaderId, (f32, Vec3)),
    [center, right, up]: [Vec3; 3],
    parts: [usize; 2],
) {
    let surface = scene.plate(shader, center, right, up, false);
    scene.whole_image(surface);
    add_parts(lamps, light, [center, right, up], parts);
}

/// Adds the parts of a plate that shines.
fn add_parts(
    lamps: &mut Vec<Lamp>,
    (value, color): (f32, Vec3),
    [center, right, up]: [Vec3; 3],
    [columns, rows]: [usize; 2],
) {
    let count = (columns * rows) as f32;
    let area = 4.0 * right.length() * up.length() / count;
    for at in 0..columns * rows {
        let part = |index: usize, of: usize| (2 * index + 1) as f32 / of as f32 - 1.0;
        let (u, v) = (part(at % columns, columns), part(at / columns, rows));
        lamps.push(Lamp {
            origin: center + right * u + up * v,
            normal: right.cross(up).normalize_or_zero(),
            light: color * (0.25 * value * area),
        });
    }
}

/// The pool: rim, walls, water, lamps below the water, and the ball of crystal in its middle.
fn pool(scene: &mut Scene, s: &Shaders, lamps: &mut Vec<Lamp>) {
    let (half, middle) = POOL;
    let (bottom, top) = WATER;
    let (mins, maxs) = ((middle - half).extend(bottom), (middle + half).extend(0.0));
    let rim = 12.0;
    for (from, to) in [
        (
            Vec2::new(mins.x - rim, mins.y - rim),
            Vec2::new(maxs.x + rim, mins.y),
        ),
        (
            Vec2::new(mins.x - rim, maxs.y),
            Vec2::new(maxs.x + rim, maxs.y + rim),
        ),
        (Vec2::new(mins.x - rim, mins.y), Vec2::new(mins.x, maxs.y)),
        (Vec2::new(maxs.x, mins.y), Vec2::new(maxs.x + rim, maxs.y)),
    ] {
        scene.block(
            s.marble,
            from.extend(0.0),
            to.extend(11.0),
            face::SIDES | face::ABOVE,
        );
    }
    let center = middle.extend(bottom * 0.5);
    let deep = Vec3::Z * (-bottom * 0.5);
    let (along, across) = (Vec3::X * half.x, Vec3::Y * half.y);
    scene.plate(s.mosaic, middle.extend(bottom), along, across, true);
    for (out, right) in [
        (along, -across),
        (-along, across),
        (across, along),
        (-across, -along),
    ] {
        scene.plate(s.mosaic, center + out, right, deep, true);
    }
    let floor = Vec3::Z * 16.0;
    scene
        .map
        .add_box_brush(s.mosaic, mins - floor, maxs.with_z(bottom));
    for side in [-1.0, 1.0] {
        let at = center + across * (side * 0.985) + Vec3::Z * 4.0;
        let right = Vec3::X * (side * half.x * 0.8);
        lamp(
            scene,
            lamps,
            (s.lamp_teal, TEAL),
            [at, right, Vec3::Z * 5.0],
            [6, 1],
        );
    }
    scene.plate(s.water, middle.extend(top), along, across, false);
    scene.map.add_box_brush(s.water, mins, maxs.with_z(top));

    let foot = middle.extend(bottom);
    scene.column(s.fluted, foot, 16.0, 88.0 - 8.0);
    let wide = Vec3::new(24.0, 24.0, 0.0);
    let cap = foot + Vec3::Z * 80.0;
    scene.block(
        s.marble,
        cap - wide,
        cap + wide + Vec3::Z * 8.0,
        face::SIDES | face::ABOVE | face::BELOW,
    );
    scene.ball(s.crystal, cap + Vec3::Z * 42.0, 34.0);
}

/// The mirror in its frame.
fn mirror(scene: &mut Scene, s: &Shaders) {
    let (center, half) = MIRROR;
    let right = MIRROR_NORMAL.cross(Vec3::Z).normalize() * -1.0;
    let (across, up) = (right * half.x, Vec3::Z * half.y);
    scene.plate(s.mirror, center, across, up, false);
    // the frame: four bars that stand out of the glass by a little
    let bar = 7.0;
    let out = MIRROR_NORMAL * 4.0;
    for (at, bar_half, long) in [
        (
            up + Vec3::Z * bar,
            Vec3::Z * bar,
            across + right * 2.0 * bar,
        ),
        (
            -up - Vec3::Z * bar,
            Vec3::Z * bar,
            across + right * 2.0 * bar,
        ),
    ] {
        scene.plate(s.bronze, center + at + out, long, bar_half, true);
        let inward = if at.z > 0.0 { -1.0 } else { 1.0 };
        let lip = center + at + bar_half * inward + out * 0.5;
        scene.plate(s.bronze, lip, long * inward, out * -0.5, true);
    }
    for side in [-1.0, 1.0] {
        let at = (across + right * bar) * side;
        scene.plate(s.bronze, center + at + out, right * bar, up, true);
        let lip = center + across * side + out * 0.5;
        scene.plate(s.bronze, lip, out * (0.5 * side), up, true);
        let rim = center + (across + right * 2.0 * bar) * side;
        scene.plate(s.bronze, rim, out * -side, up + Vec3::Z * 2.0 * bar, true);
    }
    for (at, depth) in [
        (up + Vec3::Z * 2.0 * bar, -out),
        (-up - Vec3::Z * 2.0 * bar, out),
    ] {
        let long = across + right * 2.0 * bar;
        scene.plate(s.bronze, center + at, long, depth, true);
    }
    // its back
    scene.plate(
        s.wood,
        center - out,
        -(across + right * 2.0 * bar),
        up + Vec3::Z * 2.0 * bar,
        true,
    );
    let size = Vec3::new(half.x * 0.6, half.x * 0.75, half.y + 14.0);
    scene
        .map
        .add_box_brush(s.wood, center - size, center + size);
}

/// A lantern: four glowing sides between a base and a lid, on a rod.
fn lantern(scene: &mut Scene, s: &Shaders, lamps: &mut Vec<Lamp>, (at, hung): (Vec3, f32)) {
    let (half, tall) = (9.0, 15.0);
    for (out, right) in [
        (Vec3::X, Vec3::Y),
        (Vec3::NEG_X, Vec3::NEG_Y),
        (Vec3::Y, Vec3::NEG_X),
        (Vec3::NEG_Y, Vec3::X),
    ] {
        let sides = [at + out * half, right * half, Vec3::Z * tall];
        lamp(scene, lamps, (s.lamp_warm, WARM), sides, [1, 1]);
    }
    for (low, high, wide) in [
        (-tall - 5.0, -tall, 11.0),
        (tall, tall + 4.0, 12.0),
        (tall + 4.0, tall + 9.0, 7.0),
    ] {
        let wide = Vec3::new(wide, wide, 0.0);
        let (mins, maxs) = (at - wide + Vec3::Z * low, at + wide + Vec3::Z * high);
        scene.block(
            s.bronze,
            mins,
            maxs,
            face::SIDES | face::ABOVE | face::BELOW,
        );
    }
    let thin = Vec3::new(1.5, 1.5, 0.0);
    let (mins, maxs) = (at - thin + Vec3::Z * (tall + 9.0), (at + thin).with_z(hung));
    scene.block(s.bronze, mins, maxs, face::SIDES);
}

/// Adds everything; returns the parts of the lamps.
pub(super) fn build(scene: &mut Scene, s: &Shaders) -> Vec<Lamp> {
    let mut lamps = Vec::new();
    pool(scene, s, &mut lamps);
    mirror(scene, s);
    for at in LANTERNS {
        lantern(scene, s, &mut lamps, at);
    }
    // round windows above both ends of the hall, in rings of bronze
    for (end, right) in [(-1.0, Vec3::Y), (1.0, Vec3::NEG_Y)] {
        let middle = Vec3::new(end * (LENGTH - 2.0), 0.0, 290.0);
        let (across, up) = (right * 58.0, Vec3::Z * 58.0);
        let behind = Vec3::X * end;
        scene.disc(s.lamp_rose, middle, across, up);
        add_parts(
            &mut lamps,
            ROSE,
            [middle, across * 0.886, up * 0.886],
            [2, 2],
        );
        let ring = scene.disc(s.bronze, middle + behind, across * 1.12, up * 1.12);
        scene.light(ring, 130.0, 130.0);
    }
    // the sky seen through the openings
    for (from, right, half) in windows::openings() {
        let parts = [right * half.x, Vec3::Z * half.y];
        add_parts(&mut lamps, SKY, [from, parts[0], parts[1]], [1, 1]);
    }
    lamps
}

/// The fog on the terrace; its index.
pub(super) fn mist(scene: &mut Scene, s: &Shaders) -> i32 {
    let (mins, maxs) = (
        Vec3::new(LENGTH, -240.0, STEP),
        Vec3::new(TERRACE, 240.0, 96.0),
    );
    let fog = scene.map.add_fog_brush(s.mist, mins, maxs, 5);
    let (center, half) = ((mins + maxs) * 0.5, (maxs - mins) * 0.5);
    let top = scene.plate(
        s.mist,
        center.with_z(maxs.z),
        Vec3::X * half.x,
        Vec3::Y * half.y,
        false,
    );
    scene.map.set_fog(top, fog);
    fog
}
