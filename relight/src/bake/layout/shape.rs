//! What form a surface has for a chart: flat, bent but seen whole along one axis, a curve, or none of these.

use glam::{Vec2, Vec3};
use q3bsp::{Bsp, Surface, SurfaceKind};

/// Most that a vertex of a flat surface may lie off its plane, id units. Compilers store vertices as floats after snapping
/// to 1/8 unit.
const FLAT: f32 = 0.125;

/// Least cosine between a triangle and the axis that it is projected along. Compilers select axes with 0.577 or more.
const LEAST_COSINE: f32 = 0.35;

/// Area below which a triangle's normal is rounding noise, square units.
const SLIVER: f32 = 1e-3;

/// A plane of a flat surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flat {
    /// Unit normal to the front.
    pub normal: Vec3,
    /// Distance of the plane from the origin.
    pub dist: f32,
}

/// How a surface can be laid out.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// Seen whole along an axis of the world.
    Projected {
        /// The axis: 0 to 2 for x, y, z.
        axis: usize,
        /// Whether the front looks towards positive values.
        positive: bool,
        /// Its plane; `None` for a bent surface.
        flat: Option<Flat>,
        /// Its vertices along the two other axes.
        points: Vec<Vec2>,
    },
    /// A curved patch.
    Grid {
        /// Control points per row.
        columns: usize,
        /// The control points.
        points: Vec<Vec3>,
    },
    /// Neither.
    Other,
}

/// Corners of the triangles of a surface, as indices of its vertices; of a patch, of its control points.
pub(super) fn corners(bsp: &Bsp, surface: &Surface) -> Vec<[usize; 3]> {
    if surface.kind != SurfaceKind::Patch {
        let triangles = bsp.surface_triangles(surface);
        return triangles.map(|t| t.map(|i| i as usize)).collect();
    }
    let size = |n: i32| usize::try_from(n).unwrap_or(0);
    let (width, height) = (size(surface.patch_width), size(surface.patch_height));
    let mut found = Vec::new();
    for y in 1..height {
        for x in 1..width {
            let (here, above) = (y * width + x, (y - 1) * width + x);
            found.push([above - 1, here - 1, above]);
            found.push([above, here - 1, here]);
        }
    }
    found
}

/// A point without its coordinate along an axis.
pub(super) fn project(point: Vec3, axis: usize) -> Vec2 {
    match axis {
        0 => Vec2::new(point.y, point.z),
        1 => Vec2::new(point.x, point.z),
        _ => Vec2::new(point.x, point.y),
    }
}

/// The axis that a normal deviates least from; on ties z, then x, as map compilers decide.
fn main_axis(normal: Vec3) -> usize {
    let n = normal.abs();
    if n.z >= n.x && n.z >= n.y {
        2
    } else if n.x >= n.y {
        0
    } else {
        1
    }
}

/// The form of a surface with finite positions.
pub(super) fn shape(bsp: &Bsp, surface: &Surface) -> Shape {
    let vertices = bsp.surface_vertices(surface);
    let points: Vec<Vec3> = vertices.iter().map(|v| v.finite().position).collect();
    let at = |i: usize| points.get(i).copied().unwrap_or(Vec3::ZERO);
    let corners = corners(bsp, surface);
    // twice the area; fronts are clockwise
    let fronts: Vec<Vec3> = (corners.iter())
        .map(|&[a, b, c]| (at(c) - at(a)).cross(at(b) - at(a)))
        .filter(|front| front.length() > SLIVER)
        .collect();
    let sum: Vec3 = fronts.iter().sum();
    let normal = sum.normalize_or_zero();
    let other = match surface.kind {
        SurfaceKind::Patch => Shape::Grid {
            columns: usize::try_from(surface.patch_width).unwrap_or(0),
            points: points.clone(),
        },
        _ => Shape::Other,
    };
    if normal == Vec3::ZERO || !sum.is_finite() {
        return other;
    }
    let axis = main_axis(normal);
    let along = normal[axis];
    let seen = |front: &Vec3| front[axis] * along.signum() >= LEAST_COSINE * front.length();
    if !fronts.iter().all(seen) {
        return other;
    }
    let dists = points.iter().map(|p| normal.dot(*p));
    let (low, high) = dists.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), d| {
        (l.min(d), h.max(d))
    });
    let flat = (high - low <= 2.0 * FLAT).then_some(Flat {
        normal,
        dist: (low + high) * 0.5,
    });
    if surface.kind == SurfaceKind::Patch && flat.is_none() {
        return other;
    }
    Shape::Projected {
        axis,
        positive: along > 0.0,
        flat,
        points: points.iter().map(|p| project(*p, axis)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::builder::MapBuilder;

    #[test]
    fn a_slope_is_seen_along_its_main_axis() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        let slope = [(0., 0., 0.), (0., 64., 0.), (64., 64., 32.), (64., 0., 32.)];
        let at = map.add_quad(wall, slope.map(Vec3::from));
        let bsp = map.build();
        let Shape::Projected {
            axis,
            positive,
            flat,
            points,
        } = shape(&bsp, &bsp.surfaces[at])
        else {
            panic!("not projected")
        };
        assert_eq!((axis, positive), (2, true));
        assert!(flat.unwrap().normal.z > 0.8);
        assert_eq!(points[2], Vec2::splat(64.0));
    }

    #[test]
    fn a_closed_surface_has_no_axis() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        let faces = map.add_box_faces(wall, Vec3::ZERO, Vec3::splat(64.0), false);
        let mut bsp = map.build();
        // all six faces as one surface
        let triangles: Vec<i32> = (0..6)
            .flat_map(|f| [0, 1, 2, 0, 2, 3].map(|i| f * 4 + i))
            .collect();
        let first = &mut bsp.surfaces[faces[0]];
        (first.num_verts, first.first_index) = (24, bsp.indices.len() as i32);
        first.num_indices = triangles.len() as i32;
        bsp.indices.extend(triangles);
        assert_eq!(shape(&bsp, &bsp.surfaces[faces[0]]), Shape::Other);
    }
}
