//! The sample's hall: a nave under a barrel vault between two arcades, aisles, and a terrace at the east end.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::Shaders;
use super::plan::*;
use super::scene::{Scene, circle, face};

/// Height of the wall's face around the east arch, from where the arch begins.
const ABOVE_ARCH: f32 = 120.0;

fn x(half: f32) -> Vec3 {
    Vec3::X * half
}

fn y(half: f32) -> Vec3 {
    Vec3::Y * half
}

fn z(half: f32) -> Vec3 {
    Vec3::Z * half
}

/// A wall with an arch: its face between the arch of `radius` around `center` and `top` above it. `along`: to the
/// right, seen from the front.
fn spandrel(
    scene: &mut Scene,
    shaders: &Shaders,
    center: Vec3,
    along: Vec3,
    radius: f32,
    top: f32,
) {
    let columns = 13;
    scene.curve(
        shaders.stone,
        [columns, 3],
        Vec2::new(2.0 * radius, top),
        |column, row| {
            let arc = circle(PI, -PI, columns / 2, column) * radius;
            let straight = (column as f32 / (columns - 1) as f32 * 2.0 - 1.0) * radius;
            let low = center + along * arc.x + z(arc.y);
            let high = center + along * straight + z(top);
            let p = low.lerp(high, row as f32 * 0.5);
            (
                p,
                Vec2::new(p.x * along.x.abs() + p.y * along.y.abs(), -p.z) / 128.0,
            )
        },
    );
}

/// The underside of an arch, `depth` units deep around `center`. `along`: to the right, seen along `into`.
fn soffit(
    scene: &mut Scene,
    shaders: &Shaders,
    center: Vec3,
    along: Vec3,
    into: Vec3,
    radius: f32,
) {
    let columns = 13;
    scene.curve(
        shaders.marble,
        [columns, 3],
        Vec2::new(PI * radius, into.length()),
        |column, row| {
            let arc = circle(PI, -PI, columns / 2, column) * radius;
            let p = center + along * arc.x + z(arc.y) + into * (row as f32 * 0.5 - 0.5);
            (p, Vec2::new(column as f32 * 0.16, row as f32 * 0.125))
        },
    );
}

/// An arcade at `side` × [`NAVE`]: columns, arches and the wall above them.
fn arcade(scene: &mut Scene, s: &Shaders, side: f32) {
    let middle = side * NAVE;
    let radius = BAY - ARCADE;
    let top = AISLE - COLUMN;
    for bay in BAYS {
        let center = Vec3::new(bay, middle, COLUMN);
        spandrel(scene, s, center + y(ARCADE), x(-1.0), radius, top);
        spandrel(scene, s, center - y(ARCADE), x(1.0), radius, top);
        soffit(scene, s, center, x(1.0), y(-2.0 * ARCADE), radius);
    }
    for at in [-225.0, 0.0, 225.0] {
        let foot = Vec3::new(at, middle, 0.0);
        let box_at = |half: f32, low: f32, high: f32| {
            let wide = Vec3::new(half, half, 0.0);
            (foot - wide + z(low), foot + wide + z(high))
        };
        for (half, low, high) in [
            (24.0, 0.0, 10.0),
            (20.0, 10.0, 18.0),
            (21.0, 116.0, 124.0),
            (24.0, 124.0, COLUMN),
        ] {
            let (mins, maxs) = box_at(half, low, high);
            let ends = if low > 50.0 {
                face::BELOW | face::ABOVE
            } else {
                face::ABOVE
            };
            scene.block(s.marble, mins, maxs, face::SIDES | ends);
        }
        scene.column(s.fluted, foot + z(18.0), ARCADE, 98.0);
        let (mins, maxs) = box_at(ARCADE, COLUMN, AISLE);
        scene.block(s.stone, mins, maxs, face::NORTH | face::SOUTH);
    }
    // where the arches meet the end walls
    for end in [-1.0, 1.0] {
        let from = Vec3::new(end * (LENGTH - ARCADE * 0.5), middle, 0.0);
        let half = Vec3::new(ARCADE * 0.5, ARCADE, 0.0);
        let inner = if end < 0.0 { face::EAST } else { face::WEST };
        let faces = face::NORTH | face::SOUTH | inner;
        scene.block(s.stone, from - half, from + half + z(AISLE), faces);
    }
    // cornices, and the band between wall and vault
    let cornice = |low: f32, high: f32, out: f32| {
        let half = Vec3::new(LENGTH, ARCADE + out, 0.0);
        let middle = Vec3::new(0.0, middle, 0.0);
        (middle - half + z(low), middle + half + z(high))
    };
    let inner = if side > 0.0 { face::SOUTH } else { face::NORTH };
    let (mins, maxs) = cornice(AISLE - 6.0, AISLE, 4.0);
    scene.block(s.marble, mins, maxs, inner | face::BELOW);
    let (mins, maxs) = cornice(AISLE, SPRING, 9.0);
    scene.block(s.bronze, mins, maxs, inner | face::BELOW | face::ABOVE);
}

/// The vault and its ribs.
fn vault(scene: &mut Scene, s: &Shaders) {
    let arc = |column: usize, radius: f32| {
        let p = circle(PI, -PI, 8, column) * radius;
        Vec3::new(0.0, p.x, p.y + SPRING)
    };
    let around = PI * VAULT;
    scene.curve(
        s.coffer,
        [17, 3],
        Vec2::new(around, 2.0 * LENGTH),
        |column, row| {
            let at = LENGTH * (row as f32 - 1.0);
            // whole coffers on either side of the ribs
            (
                arc(column, VAULT) + x(at),
                Vec2::new(column as f32 * 0.5, at / 45.0),
            )
        },
    );
    for at in [-337.5, -225.0, -112.5, 0.0, 112.5, 225.0, 337.5] {
        let (inner, half) = (VAULT - 9.0, 9.0);
        let st = |column: usize, v: f32| Vec2::new(column as f32 * 0.2, v);
        scene.curve(
            s.marble,
            [17, 3],
            Vec2::new(around, 2.0 * half),
            |column, row| {
                let along = half * (row as f32 - 1.0);
                (
                    arc(column, inner) + x(at + along),
                    st(column, row as f32 * 0.1),
                )
            },
        );
        for (end, out) in [(-half, true), (half, false)] {
            scene.curve(s.marble, [17, 3], Vec2::new(around, 9.0), |column, row| {
                let depth = if out { 2.0 - row as f32 } else { row as f32 } * 4.5;
                (
                    arc(column, inner + depth) + x(at + end),
                    st(column, row as f32 * 0.05),
                )
            });
        }
    }
}

/// Floors, ceilings of the aisles, north and end walls.
fn shell(scene: &mut Scene, s: &Shaders) {
    let (half, middle) = POOL;
    let [west, east] = [middle.x - half.x, middle.x + half.x];
    for (from, to, low, high) in [
        (-LENGTH, west, -WIDTH, WIDTH),
        (east, LENGTH, -WIDTH, WIDTH),
        (west, east, half.y, WIDTH),
        (west, east, -WIDTH, -half.y),
    ] {
        let (mins, maxs) = (Vec3::new(from, low, -64.0), Vec3::new(to, high, 0.0));
        scene.block(s.floor, mins, maxs, face::ABOVE);
    }
    for side in [-1.0, 1.0] {
        let center = Vec3::new(0.0, side * (NAVE + WIDTH) * 0.5, AISLE);
        scene.plate(s.wood, center, y((WIDTH - NAVE) * 0.5), x(LENGTH), true);
    }
    // the north wall with its pilasters, and wainscot
    let north = Vec3::new(0.0, WIDTH + 8.0, AISLE * 0.5);
    let thick = Vec3::new(LENGTH, 8.0, AISLE * 0.5);
    scene.block(s.stone, north - thick, north + thick, face::SOUTH);
    for at in [-225.0, 0.0, 225.0] {
        let (from, to) = (
            Vec3::new(at - 18.0, WIDTH - 10.0, 0.0),
            Vec3::new(at + 18.0, WIDTH, AISLE),
        );
        scene.block(s.marble, from, to, face::SOUTH | face::EAST | face::WEST);
    }
    for bay in BAYS {
        let (from, to) = (
            Vec3::new(bay - 94.0, WIDTH - 5.0, 0.0),
            Vec3::new(bay + 94.0, WIDTH, 52.0),
        );
        scene.block(s.wood, from, to, face::SOUTH | face::ABOVE);
    }
    // the west wall, and a door in it
    let tall = SPRING + VAULT;
    let west = Vec3::new(-LENGTH - 8.0, 0.0, tall * 0.5);
    let thick = Vec3::new(8.0, WIDTH, tall * 0.5);
    scene.block(s.stone, west - thick, west + thick, face::EAST);
    let door = Vec3::new(4.0, 52.0, 0.0);
    let foot = Vec3::new(-LENGTH, 0.0, 0.0);
    scene.block(
        s.wood,
        foot - door,
        foot + door + z(128.0),
        face::EAST | face::ABOVE,
    );
    // the east wall around its opening
    let (open, spring) = EAST;
    for side in [-1.0, 1.0] {
        let center = Vec3::new(LENGTH + 12.0, side * (open + WIDTH) * 0.5, tall * 0.5);
        let half = Vec3::new(12.0, (WIDTH - open) * 0.5, tall * 0.5);
        let inner = if side < 0.0 { face::NORTH } else { face::SOUTH };
        scene.block(
            s.stone,
            center - half,
            center + half,
            face::WEST | face::EAST | inner,
        );
    }
    let arch = Vec3::new(LENGTH, 0.0, spring);
    soffit(scene, s, arch + x(12.0), y(-1.0), x(-24.0), open);
    let rest = tall - spring - ABOVE_ARCH;
    for (face, along) in [(x(0.0), y(-1.0)), (x(24.0), y(1.0))] {
        spandrel(scene, s, arch + face, along, open, ABOVE_ARCH);
        let above = arch + face + z(ABOVE_ARCH + rest * 0.5);
        scene.plate(s.stone, above, along * open, z(rest * 0.5), true);
    }
    let (mins, maxs) = (
        Vec3::new(LENGTH, -open, spring + open),
        Vec3::new(LENGTH + 24.0, open, tall),
    );
    scene.block(s.stone, mins, maxs, 0);
}

/// Steps up to the terrace, its floor and parapet, and the sky around it.
fn terrace(scene: &mut Scene, s: &Shaders) {
    let (open, _) = EAST;
    for (from, high) in [(LENGTH - 40.0, STEP * 0.5), (LENGTH - 20.0, STEP)] {
        let (mins, maxs) = (
            Vec3::new(from, -open - 24.0, 0.0),
            Vec3::new(LENGTH, open + 24.0, high),
        );
        scene.block(
            s.marble,
            mins,
            maxs,
            face::WEST | face::NORTH | face::SOUTH | face::ABOVE,
        );
    }
    let (mins, maxs) = (
        Vec3::new(LENGTH, -240.0, -64.0),
        Vec3::new(TERRACE, 240.0, STEP),
    );
    scene.block(s.floor, mins, maxs, face::ABOVE);
    let (mins, maxs) = (
        Vec3::new(TERRACE - 24.0, -240.0, STEP),
        Vec3::new(TERRACE - 12.0, 240.0, 56.0),
    );
    scene.block(s.marble, mins, maxs, face::WEST | face::ABOVE);
    for at in [-150.0, -50.0, 50.0, 150.0] {
        scene.column(s.marble, Vec3::new(TERRACE - 34.0, at, STEP), 9.0, 66.0);
    }
    let middle = Vec3::new((LENGTH + 24.0 + TERRACE) * 0.5, 0.0, 190.0);
    let half = Vec3::new((TERRACE - LENGTH - 24.0) * 0.5, 240.0, 210.0);
    for (out, right, up) in [
        (x(half.x), y(-half.y), z(half.z)),
        (y(half.y), x(half.x), z(half.z)),
        (y(-half.y), x(-half.x), z(half.z)),
        (z(half.z), y(half.y), x(half.x)),
    ] {
        scene.plate(s.sky, middle + out, right, up, false);
    }
    // what keeps players in: around the terrace and above everything
    let (west, east, side, top) = (LENGTH, TERRACE, 240.0, SPRING + VAULT);
    for (mins, maxs) in [
        (
            Vec3::new(east, -side, 0.0),
            Vec3::new(east + 16.0, side, top),
        ),
        (
            Vec3::new(west, side, 0.0),
            Vec3::new(east, side + 16.0, top),
        ),
        (
            Vec3::new(west, -side - 16.0, 0.0),
            Vec3::new(east, -side, top),
        ),
        (
            Vec3::new(-west, -WIDTH, top),
            Vec3::new(east, WIDTH, top + 16.0),
        ),
    ] {
        scene.map.add_box_brush(s.sky, mins, maxs);
    }
}

/// Adds the whole hall.
pub(super) fn build(scene: &mut Scene, shaders: &Shaders) {
    shell(scene, shaders);
    vault(scene, shaders);
    for side in [-1.0, 1.0] {
        arcade(scene, shaders, side);
    }
    terrace(scene, shaders);
}
