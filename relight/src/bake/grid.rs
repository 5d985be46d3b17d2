//! The light grid, which lights models.
//!
//! A point stores the mean direction D of its light, weighted by strength; *directed* light, the part of each light c that
//! comes from there, c max(0, d · D); and *ambient* light, a quarter of the rest, with the world's ambient term. Reflected
//! light of all directions is not in it.
//!
//! Source: q3map2's light grid, as measured on maps with known lights (`calibrate::light_grid`).

use super::{Encoding, Gather, GatherError, GatherProgress, Point, targets};
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::GridPoint;
use std::f32::consts::TAU;
use support::parallel;

/// Most points of a grid that a map lacks: what compilers allow.
const MOST: usize = 1 << 20;

/// A point inside of a wall.
const EMPTY: GridPoint = GridPoint {
    ambient: [0; 3],
    directed: [0; 3],
    longitude: 0,
    latitude: 0,
};

/// Part of the light from elsewhere that becomes ambient.
const AMBIENT: f32 = 0.25;

/// Places that are tried for a point in solid, in parts of the spacing.
const TRIES: [[f32; 3]; 14] = [
    [0.25, 0.0, 0.0],
    [-0.25, 0.0, 0.0],
    [0.0, 0.25, 0.0],
    [0.0, -0.25, 0.0],
    [0.0, 0.0, 0.2],
    [0.0, 0.0, -0.2],
    [0.45, 0.0, 0.0],
    [-0.45, 0.0, 0.0],
    [0.0, 0.45, 0.0],
    [0.0, -0.45, 0.0],
    [0.35, 0.35, 0.0],
    [-0.35, 0.35, 0.0],
    [0.35, -0.35, 0.0],
    [-0.35, -0.35, 0.0],
];

/// Computes a grid; `None` for a map that can have none.
///
/// # Errors
/// Those of `gather`.
pub(super) fn bake(
    world: &RelitWorld,
    gather: &mut dyn Gather,
    samples: u32,
    encoding: Encoding,
    (ambient, least): (Vec3, Vec3),
    progress: GatherProgress<'_>,
) -> Result<Option<Vec<GridPoint>>, GatherError> {
    let most = MOST.max(world.bsp.light_grid.len());
    let Some(layout) = world.bsp.light_grid_layout(most) else {
        return Ok(None);
    };
    let [nx, ny, _] = layout.counts;
    let count = layout.points();
    let space = targets::FreeSpace::of(world);
    let numbers: Vec<usize> = (0..count).collect();
    let free = parallel::map(&numbers, |_, &i| {
        let at = layout.position(i % nx, i / nx % ny, i / nx / ny);
        let moved = TRIES
            .iter()
            .map(|t| at + Vec3::from_array(*t) * layout.size);
        std::iter::once(at).chain(moved).find(|at| space.has(*at))
    });
    let everywhere: Vec<Point> = free
        .iter()
        .flatten()
        .map(|&position| Point::new(position, Vec3::ZERO))
        .collect();
    let all = gather.direct(&everywhere, samples, &mut |part| progress(part * 0.5))?;
    let facing: Vec<Point> = everywhere
        .iter()
        .zip(&all)
        .map(|(point, light)| Point {
            normal: light.towards.normalize_or(Vec3::Z),
            ..*point
        })
        .collect();
    let directed = gather.direct(&facing, samples, &mut |part| progress(0.5 + part * 0.5))?;
    let mut lit = all.iter().zip(&directed).zip(&facing);
    let points = free.iter().map(|place| {
        let Some(((all, directed), facing)) = place.and_then(|_| lit.next()) else {
            return EMPTY;
        };
        let rest = (all.value - directed.value).max(Vec3::ZERO);
        let ambient = (ambient + rest * AMBIENT).max(least);
        let mut stored = encoding.bytes(ambient, 1.0);
        let directed = encoding.bytes(directed.value, 1.0);
        if stored == [0; 3] && directed != [0; 3] {
            // a point without ambient light counts as one inside of a wall
            stored = [1; 3];
        }
        let [longitude, latitude] = angles(facing.normal);
        GridPoint {
            ambient: stored,
            directed,
            longitude,
            latitude,
        }
    });
    Ok(Some(points.collect()))
}

/// Angle from the z axis and angle around it, 1/256 turns, as [`GridPoint::direction`] reads them.
fn angles(direction: Vec3) -> [u8; 2] {
    let turn = |angle: f32| (angle / TAU * 256.0).round().rem_euclid(256.0) as u8;
    [
        turn(direction.z.clamp(-1.0, 1.0).acos()),
        turn(direction.y.atan2(direction.x)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_give_the_direction_back() {
        for direction in [
            Vec3::X,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::new(0.3, -0.8, 0.5).normalize(),
        ] {
            let [longitude, latitude] = angles(direction);
            let point = GridPoint {
                longitude,
                latitude,
                ..EMPTY
            };
            let cosine = point.direction().dot(direction);
            assert!(cosine > 0.9997, "{direction}: {}", point.direction());
        }
    }
}
