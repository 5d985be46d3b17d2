//! The south wall of the sample's hall with its windows, and which light passes them.

use glam::{Vec2, Vec3};

use super::Shaders;
use super::plan::*;
use super::scene::{Scene, face};
use super::textures::{GLASS, grate_is_solid};

/// Half of the width of the windows' openings, their lower and their upper ends.
const WINDOW: (f32, f32, f32) = (60.0, 48.0, 208.0);
/// Columns and rows of panes of a window.
const PANES: [usize; 2] = [4, 5];
/// Stored light behind coloured glass over the light before it times the glass's colour: the fit of the sun to the
/// lightmaps knows of no glass, and finds the sun of the script where the mean over the three colours is about 1.
const STAINED: f32 = 1.7;
/// Plane of the panes.
const GLASS_Y: f32 = -282.0;
/// Outer face of the south wall.
const OUTSIDE_Y: f32 = -292.0;

/// Which of the three colours of glass a pane has.
fn pane_color([column, row]: [usize; 2]) -> usize {
    match (column, row) {
        (0 | 3, _) => 2,
        (_, 0 | 4) => 0,
        (1, 1) | (2, 3) | (1, 3) | (2, 1) => 1,
        _ => 0,
    }
}

/// Part of the sun's light that passes the windows on the way from `from` towards `direction`.
pub(super) fn tint(from: Vec3, direction: Vec3) -> Vec3 {
    let length = (GLASS_Y - from.y) / direction.y;
    if length <= 0.0 {
        return Vec3::ONE;
    }
    let at = from + direction * length;
    let (half, low, high) = WINDOW;
    let opening = BAYS.iter().position(|bay| (at.x - bay).abs() < half);
    let Some(window) = opening.filter(|_| (low..high).contains(&at.z)) else {
        // walls and roof, or past the hall's east end
        return if at.x.abs() < LENGTH {
            Vec3::ZERO
        } else {
            Vec3::ONE
        };
    };
    if !is_glazed(window) {
        let solid = grate_is_solid(Vec2::new(at.x, -at.z) / 128.0);
        return if solid { Vec3::ZERO } else { Vec3::ONE };
    }
    let bay = BAYS.get(window).copied().unwrap_or_default();
    let part = Vec2::new(
        (at.x - bay + half) / (2.0 * half),
        (at.z - low) / (high - low),
    );
    let pane = [0, 1].map(|axis| (part[axis] * PANES[axis] as f32) as usize);
    GLASS[pane_color(pane)] * STAINED
}

/// Whether a window has panes; the others have a grate.
fn is_glazed(window: usize) -> bool {
    window == 1 || window == 2
}

/// The south wall with its windows, and what stands before the sky behind it.
pub(super) fn build(scene: &mut Scene, s: &Shaders) {
    let (half, low, high) = WINDOW;
    let mut start = -LENGTH;
    for (index, bay) in BAYS.into_iter().enumerate() {
        let wall = |from: f32, to: f32, low: f32, high: f32| {
            (Vec3::new(from, OUTSIDE_Y, low), Vec3::new(to, -WIDTH, high))
        };
        let (mins, maxs) = wall(start, bay - half, 0.0, AISLE);
        scene.block(s.stone, mins, maxs, face::NORTH | face::EAST | face::WEST);
        start = bay + half;
        let (mins, maxs) = wall(bay - half, start, 0.0, low);
        scene.block(s.stone, mins, maxs, face::NORTH | face::ABOVE);
        let (mins, maxs) = wall(bay - half, start, high, AISLE);
        scene.block(s.stone, mins, maxs, face::NORTH | face::BELOW);
        let sill = Vec3::new(half + 8.0, 8.0, 0.0);
        let at = Vec3::new(bay, -WIDTH, low);
        scene.block(
            s.marble,
            at - sill - Vec3::Z * 8.0,
            at + sill,
            face::SIDES | face::BELOW | face::ABOVE,
        );
        // nobody passes, whether through glass or bars; behind the panes, whose images are not the brush's
        let filled = if is_glazed(index) {
            s.glass[0]
        } else {
            s.grate
        };
        scene.map.add_box_brush(
            filled,
            Vec3::new(bay - half, GLASS_Y - 3.0, low),
            Vec3::new(bay + half, GLASS_Y - 1.0, high),
        );
        if is_glazed(index) {
            glass(scene, s, bay);
        } else {
            let center = Vec3::new(bay, GLASS_Y, (low + high) * 0.5);
            scene.plate(
                s.grate,
                center,
                Vec3::X * -half,
                Vec3::Z * ((high - low) * 0.5),
                true,
            );
        }
    }
    let (mins, maxs) = (
        Vec3::new(start, OUTSIDE_Y, 0.0),
        Vec3::new(LENGTH, -WIDTH, AISLE),
    );
    scene.block(s.stone, mins, maxs, face::NORTH | face::WEST);
    scene.plate(
        s.sky,
        Vec3::new(0.0, -336.0, 130.0),
        Vec3::X * (-LENGTH - 280.0),
        Vec3::Z * 170.0,
        false,
    );
}

/// The panes of a window and the bars that hold them.
fn glass(scene: &mut Scene, s: &Shaders, bay: f32) {
    let (half, low, high) = WINDOW;
    let size = Vec2::new(2.0 * half, high - low) / Vec2::new(PANES[0] as f32, PANES[1] as f32);
    for row in 0..PANES[1] {
        for column in 0..PANES[0] {
            let at = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) * size;
            let center = Vec3::new(bay - half + at.x, GLASS_Y, low + at.y);
            let shader = s.glass[pane_color([column, row])];
            let pane = scene.plate(
                shader,
                center,
                Vec3::X * (-size.x * 0.5),
                Vec3::Z * (size.y * 0.5),
                false,
            );
            scene.whole_image(pane);
        }
    }
    let middle = Vec3::new(bay, GLASS_Y, (low + high) * 0.5);
    let bar = Vec3::new(2.5, 3.0, (high - low) * 0.5);
    scene.block(s.bronze, middle - bar, middle + bar, face::SIDES);
    for row in [2.0, 3.0] {
        let at = Vec3::new(bay, GLASS_Y, low + row * size.y);
        let bar = Vec3::new(half, 3.0, 1.5);
        scene.block(
            s.bronze,
            at - bar,
            at + bar,
            face::NORTH | face::ABOVE | face::BELOW,
        );
    }
}

/// The openings to the sky: middle, direction to the right seen from inside, and half of the size.
pub(super) fn openings() -> impl Iterator<Item = (Vec3, Vec3, Vec2)> {
    let (half, low, high) = WINDOW;
    let window = move |bay: f32| {
        let middle = Vec3::new(bay, -WIDTH, (low + high) * 0.5);
        (middle, Vec3::NEG_X, Vec2::new(half, (high - low) * 0.5))
    };
    let (open, spring) = EAST;
    let east = Vec3::new(LENGTH, 0.0, spring * 0.75);
    let size = Vec2::new(open, spring * 0.65);
    BAYS.into_iter()
        .map(window)
        .chain([(east, Vec3::NEG_Y, size)])
}
