//! Vertex normals of a patch from its own grid, wrapping where opposite edges meet.

use super::PatchMesh;
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
    let position = |row: usize, column: usize| mesh.vertices[row * width + column].position;
    let meets = |a: Vec3, b: Vec3| a.distance_squared(b) <= 1.0;
    let wrap_width = (0..height).all(|row| meets(position(row, 0), position(row, width - 1)));
    let wrap_height =
        (0..width).all(|column| meets(position(0, column), position(height - 1, column)));

    let mut normals = Vec::with_capacity(mesh.vertices.len());
    for row in 0..height {
        for column in 0..width {
            let base = position(row, column);
            let around = NEIGHBOURS.map(|(dx, dy)| {
                for step in 1..=MAX_STEPS {
                    let x = place(column, dx * step, width, wrap_width)?;
                    let y = place(row, dy * step, height, wrap_height)?;
                    let edge = position(y, x) - base;
                    let length = edge.length();
                    if length >= DEGENERATE {
                        return Some(edge / length);
                    }
                }
                None
            });
            let mut sum = Vec3::ZERO;
            for (k, edge) in around.iter().enumerate() {
                if let (Some(edge), Some(next)) = (edge, around[(k + 1) % around.len()]) {
                    sum += next.cross(*edge).normalize_or_zero();
                }
            }
            let own = mesh.vertices[row * width + column].normal;
            normals.push(sum.normalize_or(own.normalize_or(Vec3::Z)));
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
