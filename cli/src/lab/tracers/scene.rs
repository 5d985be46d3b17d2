//! Made-up scenes of a stated number of triangles: a room with a lamp, two boxes, and a ball of all other triangles.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use q3bsp::DrawVert;
use q3bsp::builder::MapBuilder;
use q3bsp::content_flags::SOLID;
use relight::{FileError, MemoryFiles};

use crate::view::Camera;

/// Game path of the map.
pub const MAP: &str = "maps/tracers.bsp";

const SCRIPT: &str = "
tracers/white
{
    {
        map $whiteimage
        rgbGen exactVertex
    }
    {
        map $whiteimage
        rgbGen const ( 0.8 0.8 0.8 )
        blendFunc filter
    }
}
tracers/lamp
{
    surfaceparm nolightmap
    q3map_surfacelight 6000
    {
        map $whiteimage
    }
}
";

/// Corners of the room, units.
const LOW: Vec3 = Vec3::ZERO;
const HIGH: Vec3 = Vec3::splat(512.0);

/// The camera, which sees all that is in the room.
pub const CAMERA: Camera = Camera {
    origin: Vec3::new(24.0, 256.0, 300.0),
    yaw: 0.0,
    pitch: 12.0,
};

/// Triangles of the walls and of the lamp.
const WALLS: usize = 12;
const LAMP: usize = 1;

/// Centre and radius of the ball, units.
const BALL: (Vec3, f32) = (Vec3::new(270.0, 256.0, 270.0), 130.0);

/// Triangles of a surface at most.
const SURFACE: usize = 2048;

type Corners = [Vec3; 3];

/// The map with `triangles` triangles, at least 14, and its materials.
///
/// # Errors
/// None in practice: all paths are well-formed.
pub fn files(triangles: usize) -> Result<MemoryFiles, FileError> {
    let mut map = MapBuilder::new();
    let white = map.add_shader("tracers/white", 0, SOLID);
    let lamp = map.add_shader("tracers/lamp", 0, SOLID);
    map.add_cell(LOW, HIGH);
    let mut all = box_faces(LOW, HIGH, true);
    all.extend(box_faces(
        Vec3::new(200.0, 60.0, 1.0),
        Vec3::new(320.0, 180.0, 140.0),
        false,
    ));
    all.extend(box_faces(
        Vec3::new(300.0, 330.0, 1.0),
        Vec3::new(420.0, 450.0, 240.0),
        false,
    ));
    let left = triangles.saturating_sub(LAMP + all.len());
    // the last triangles around the lower pole are left out
    all.extend(ball(left));
    all.truncate(triangles.saturating_sub(LAMP).max(WALLS));
    for part in all.chunks(SURFACE) {
        let vertices: Vec<DrawVert> = part.iter().flat_map(|c| corners_of(*c)).collect();
        let indices: Vec<i32> = (0..).take(vertices.len()).collect();
        map.add_soup(white, &vertices, &indices);
    }
    // below the ceiling, clockwise as seen from below
    let middle = Vec3::new(256.0, 256.0, HIGH.z - 2.0);
    map.add_polygon(
        lamp,
        &[
            Vec2::new(-60.0, -60.0),
            Vec2::new(60.0, -60.0),
            Vec2::new(0.0, 80.0),
        ]
        .map(|c| middle + c.extend(0.0)),
    );
    let mut files = MemoryFiles::new();
    files.insert("scripts/tracers.shader", SCRIPT)?;
    files.insert(MAP, map.build().write())?;
    Ok(files)
}

/// A triangle whose vertices store grey light.
fn corners_of(corners: Corners) -> [DrawVert; 3] {
    let [a, b, c] = corners;
    // clockwise as seen from the front
    let normal = (c - a).cross(b - a).normalize_or(Vec3::Z);
    corners.map(|position| DrawVert {
        position,
        st: Vec2::ZERO,
        lightmap: Vec2::ZERO,
        normal,
        color: [128, 128, 128, 255],
    })
}

/// Two triangles a face; the floor is the last face.
fn box_faces(low: Vec3, high: Vec3, inside: bool) -> Vec<Corners> {
    let at = |corner: usize| {
        let pick = |axis: usize| {
            if corner >> axis & 1 == 0 {
                low[axis]
            } else {
                high[axis]
            }
        };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    // corners clockwise as seen from outside
    let faces = [
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [1, 5, 7, 3],
        [3, 7, 6, 2],
        [2, 6, 4, 0],
        [0, 1, 3, 2],
    ];
    let quads = faces.into_iter().map(|face| face.map(at));
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    triangles
        .map(|[a, b, c]| if inside { [a, c, b] } else { [a, b, c] })
        .collect()
}

/// A ball of at least `triangles` triangles, from its upper pole to its lower.
fn ball(triangles: usize) -> Vec<Corners> {
    if triangles == 0 {
        return Vec::new();
    }
    // a ring of columns at each pole has one triangle a column, all others have two: 4 n (n - 1)
    let rings = (2..).find(|n| 4 * n * (n - 1) >= triangles).unwrap_or(2);
    let columns = 2 * rings;
    let (centre, radius) = BALL;
    let at = |ring: usize, column: usize| {
        let down = ring as f32 / rings as f32 * PI;
        let around = (column % columns) as f32 / columns as f32 * TAU;
        let out = Vec2::from_angle(around) * down.sin();
        centre + out.extend(down.cos()) * radius
    };
    let places = (0..rings).flat_map(|ring| (0..columns).map(move |column| (ring, column)));
    places
        .flat_map(|(ring, column)| {
            let [a, b] = [column, column + 1].map(|c| at(ring, c));
            let [c, d] = [column, column + 1].map(|c| at(ring + 1, c));
            // clockwise as seen from outside
            [
                (ring + 1 < rings).then_some([a, d, c]),
                (ring > 0).then_some([a, b, d]),
            ]
        })
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use relight::GameFiles;

    use super::*;

    #[test]
    fn scenes_have_the_triangles_that_are_asked_for() {
        for triangles in [14, 36, 37, 38, 2064, 61_562] {
            let files = files(triangles).unwrap();
            let map = q3bsp::Bsp::parse(&files.read(MAP).unwrap().unwrap()).unwrap();
            let found: i32 = map.surfaces.iter().map(|s| s.num_indices / 3).sum();
            assert_eq!(found as usize, triangles);
            assert!(map.cluster_at(CAMERA.origin) >= 0);
        }
    }

    #[test]
    fn faces_look_outwards() {
        for [a, b, c] in box_faces(Vec3::splat(-1.0), Vec3::ONE, false) {
            assert!((c - a).cross(b - a).dot(a + b + c) > 0.0);
        }
        let ball = ball(2000);
        assert!(ball.len() >= 2000 && ball.len() < 2300);
        for [a, b, c] in ball {
            let outwards = a + b + c - 3.0 * BALL.0;
            assert!((c - a).cross(b - a).dot(outwards) > 0.0);
        }
    }
}
