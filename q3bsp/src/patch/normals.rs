//! Vertex normals of a patch from its own grid, wrapping where opposite edges meet.

use super::PatchMesh;
use crate::lumps::DrawVert;
use glam::Vec3;

/// Steps to the eight neighbours, (column, row), around the point.
const NEIGHBOURS: [(isize, isize); 8] = [
    (0, 1),
    (1, 1),
    (1, 0),
    (1, -1),
    (0, -1),
    (-1, -1),
    (-1, 0),
    (-1, 1),
];

/// Edges shorter than this are skipped in favour of the next point in the same direction, id units.
const DEGENERATE: f32 = 0.001;

/// Points looked at in each direction.
const MAX_STEPS: isize = 3;

/// Replaces all normals: the mean of the cross products of successive edges to the neighbours. Where
/// the grid has no area, the interpolated normal of the control points stays, or z.
pub(super) fn recompute(mesh: &mut PatchMesh) {
    let (width, height) = (mesh.width, mesh.height);
    let position = |row: usize, column: usize| {
        let vertex = mesh.vertices.get(row * width + column)?;
        Some(vertex.position)
    };
    let meets = |a: &DrawVert, b: &DrawVert| a.position.distance_squared(b.position) <= 1.0;
    let mut rows = mesh.vertices.chunks_exact(width);
    let wrap_width = rows.clone().all(|row| {
        let ends = row.first().zip(row.last());
        ends.is_some_and(|(a, b)| meets(a, b))
    });
    let wrap_height = match (rows.next(), rows.next_back()) {
        (Some(first), Some(last)) => first.iter().zip(last).all(|(a, b)| meets(a, b)),
        _ => false,
    };

    let mut normals = Vec::with_capacity(mesh.vertices.len());
    for (row, points) in mesh.vertices.chunks_exact(width).enumerate() {
        for (column, point) in points.iter().enumerate() {
            let around = NEIGHBOURS.map(|(dx, dy)| {
                for step in 1..=MAX_STEPS {
                    let x = place(column, dx * step, width, wrap_width)?;
                    let y = place(row, dy * step, height, wrap_height)?;
                    let edge = position(y, x)? - point.position;
                    let length = edge.length();
                    if length >= DEGENERATE {
                        return Some(edge / length);
                    }
                }
                None
            });
            let mut sum = Vec3::ZERO;
            for (edge, next) in around.iter().zip(around.iter().cycle().skip(1)) {
                if let (Some(edge), Some(next)) = (edge, next) {
                    sum += next.cross(*edge).normalize_or_zero();
                }
            }
            normals.push(sum.normalize_or(point.normal.normalize_or(Vec3::Z)));
        }
    }
    for (vertex, normal) in mesh.vertices.iter_mut().zip(normals) {
        vertex.normal = normal;
    }
}

/// A place `step` further along an axis of `size` points; beyond the end it continues behind the
/// opposite edge if they meet.
fn place(at: usize, step: isize, size: usize, wraps: bool) -> Option<usize> {
    let size = isize::try_from(size).ok()?;
    let mut place = isize::try_from(at).ok()? + step;
    if wraps && place < 0 {
        place += size - 1;
    } else if wraps && place >= size {
        place -= size - 1;
    }
    (place >= 0 && place < size).then_some(place.unsigned_abs())
}
