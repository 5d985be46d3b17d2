//! The one point of a texel, where q3map2 has it.
//!
//! It lies above the middle of the texel, in the plane of the triangle, also where the triangle covers another part of the
//! texel. If it lies in solid, half a texel beside it.
//!
//! Source: q3map2 2.5.17n, by comparison with the light that it stores (lab/notes/bake.md).

use super::Point;
use super::coverage::{INSET, Place, Square};
use super::targets::{FreeSpace, LIFT};
use glam::Vec3;
use q3bsp::SurfaceKind;

/// Distance from a brush within which a point is in solid, id units.
const MARGIN: f32 = 0.125;

/// Half the side of a square around a point, id units. The point is free if any corner of the square is, as it is for a
/// point in the plane of a wall.
const SLACK: f32 = 0.1;

/// Places in a texel, in parts of its half sides, in the order in which they are tried.
const PLACES: [(f32, f32); 9] = [
    (0.0, 0.0),
    (-1.0, 0.0),
    (1.0, 0.0),
    (0.0, 1.0),
    (0.0, -1.0),
    (-1.0, 1.0),
    (1.0, -1.0),
    (1.0, 1.0),
    (-1.0, -1.0),
];

/// Corners of a square.
const CORNERS: [(f32, f32); 4] = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];

/// Farthest middle of a texel from the place in it, in sums of its half sides.
const FARTHEST: f32 = 4.0;

impl FreeSpace<'_> {
    /// The point in a texel of a flat surface of the world. `None` for other surfaces, and if all places lie in solid.
    pub(super) fn compiler_point(&self, place: &Place) -> Option<Point> {
        let surface = self.world.surfaces.get(place.surface as usize)?;
        if surface.model != 0 || surface.kind != SurfaceKind::Planar {
            return None;
        }
        let Square { middle, half } = place.square;
        // a triangle that is hardly more than an edge has no plane
        let far = FARTHEST * (half[0].length() + half[1].length()) + INSET;
        if !middle.is_finite() || middle.distance(place.position) >= far {
            return None;
        }
        let side = half.map(|half| half.normalize_or_zero() * SLACK);
        let position = PLACES.iter().find_map(|&(x, y)| {
            let at = middle + half[0] * x + half[1] * y + place.normal * LIFT;
            let corners = CORNERS.map(|(x, y)| at + side[0] * x + side[1] * y);
            let free = corners.iter().filter(|&&at| self.is_free(at));
            let count = free.clone().count();
            // off the plane of the wall, which a ray that starts in it may meet
            (count > 0).then(|| free.sum::<Vec3>() / count as f32)
        })?;
        Some(Point::new(position, place.normal))
    }

    /// Whether q3map2 takes a position for free: it tests the brushes of the position's own leaf alone, so that a
    /// position beside the plane of a wall is free.
    fn is_free(&self, position: Vec3) -> bool {
        self.is_inside(position) && !self.world.bsp.is_in_drawn_brush(position, -MARGIN)
    }
}

#[cfg(test)]
mod tests {
    use super::super::targets::Targets;
    use super::super::tests::{room, world};
    use glam::{Vec2, Vec3};

    /// Side of a texel of the room's floor, id units.
    const TEXEL: f32 = 4.0;

    #[test]
    fn points_lie_above_the_middle_or_half_a_texel_beside_it() {
        let (mins, maxs) = (Vec3::new(-31.0, -31.0, 0.0), Vec3::new(31.0, 31.0, 64.0));
        let mut world = world(&room(&[], |map| {
            let wall = map.add_shader("t/wall", 0, 1);
            map.add_box_brush(wall, mins, maxs);
        }));
        world.has_compiled_lights = true;
        let targets = Targets::of(&world, 1);
        let floor: Vec<Vec3> = (targets.points.iter())
            .filter(|point| point.normal == Vec3::Z)
            .map(|point| point.position)
            .collect();
        let moved = |position: &&Vec3| {
            let texels = position.truncate() / TEXEL - 0.5;
            (texels - texels.round()).abs().max_element() > 1e-3
        };
        assert!(floor.len() > 15_000, "{}", floor.len());
        assert!(floor.iter().all(|p| (p.z - 1.0).abs() < 1e-3));
        // the box covers the middles of 16 x 16 texels; the outer ones of these have a place beside it
        let beside: Vec<Vec3> = floor.iter().filter(moved).copied().collect();
        assert_eq!(beside.len(), 16 * 4 - 4, "{beside:?}");
        for position in beside {
            let edge = position.truncate().abs();
            assert!((edge.max_element() - 32.0).abs() < 1e-3, "{position}");
            let along = edge.min_element() / TEXEL - 0.5;
            let is_corner = edge.abs_diff_eq(Vec2::splat(32.0), 1e-3);
            assert!(
                is_corner || (along - along.round()).abs() < 1e-3,
                "{position}"
            );
        }
    }
}
