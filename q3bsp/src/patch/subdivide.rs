//! Subdivision of one patch until its flattest chords are close enough to the curve.
//!
//! Source: behaviour of the engine's own tessellator (`r_subdivisions`), whose vertex counts over all
//! maps of OpenArena the tests compare.

use super::{MAX_GRID_SIZE, PatchMesh, normals};
use crate::lumps::DrawVert;
use glam::Vec3;

/// Below this distance from the chord a middle column is redundant and is removed, id units.
const COLLINEAR: f32 = 0.1;

/// Marks a column for removal in an error table.
const REMOVE: f32 = 999.0;

/// Columns of points, left to right; every column has the same length.
type Columns = Vec<Vec<DrawVert>>;

/// Sizes are odd, at least 3 and fit the points.
pub(super) fn tessellate(
    points: &[DrawVert],
    width: usize,
    height: usize,
    subdivisions: f32,
) -> PatchMesh {
    let mut columns: Columns = (0..width)
        .map(|column| {
            points
                .iter()
                .skip(column)
                .step_by(width)
                .map(DrawVert::finite)
                .collect()
        })
        .collect();
    let mut column_errors = subdivide(&mut columns, subdivisions);
    let mut rows = transposed(&columns, height);
    let mut row_errors = subdivide(&mut rows, subdivisions);

    // Now that the control points are dense enough, move them onto the curve.
    let mut columns = transposed(&rows, columns.len());
    columns.iter_mut().for_each(|column| put_on_curve(column));
    let mut rows = transposed(&columns, rows.len());
    rows.iter_mut().for_each(|row| put_on_curve(row));

    let mut columns = transposed(&rows, columns.len());
    remove_marked(&mut columns, &mut column_errors);
    let mut rows = transposed(&columns, rows.len());
    remove_marked(&mut rows, &mut row_errors);

    // The longer side becomes the width; mirroring keeps the front in front.
    let mut width = columns.len();
    if rows.len() > width {
        let mut transposed = transposed(&rows, width);
        width = rows.len();
        transposed.iter_mut().for_each(|row| row.reverse());
        rows = transposed;
        std::mem::swap(&mut column_errors, &mut row_errors);
        column_errors.reverse();
    }

    let mut mesh = PatchMesh {
        width,
        height: rows.len(),
        vertices: rows.into_iter().flatten().map(|v| v.finite()).collect(),
        column_errors,
        row_errors,
        lod_origin: Vec3::ZERO,
        lod_radius: 0.0,
    };
    for error in mesh.column_errors.iter_mut().chain(&mut mesh.row_errors) {
        if !error.is_finite() {
            *error = 0.0;
        }
    }
    normals::recompute(&mut mesh);
    mesh
}

fn transposed(columns: &Columns, height: usize) -> Columns {
    (0..height)
        .map(|row| {
            columns
                .iter()
                .filter_map(|column| column.get(row).copied())
                .collect()
        })
        .collect()
}

/// Halves column pairs until every middle is within `subdivisions` of its chord or the grid is full.
/// Returns one error per column. Slots do not move with columns inserted later, as in the engine.
fn subdivide(columns: &mut Columns, subdivisions: f32) -> Vec<f32> {
    let mut errors = vec![0.0; columns.len().max(MAX_GRID_SIZE)];
    let mut set = |at: usize, error: f32| {
        // The table has room for as many columns as there will be.
        if let Some(slot) = errors.get_mut(at) {
            *slot = error;
        }
    };
    let mut j = 0;
    while let Some([a, b, c]) = columns.get(j..j + 3) {
        let distance = a
            .iter()
            .zip(b)
            .zip(c)
            .map(|((a, b), c)| chord_distance(a.position, b.position, c.position))
            .fold(0.0, f32::max);
        if distance < COLLINEAR {
            set(j + 1, REMOVE);
            j += 2;
        } else if columns.len() + 2 > MAX_GRID_SIZE || distance <= subdivisions {
            set(j + 1, 1.0 / distance);
            j += 2;
        } else {
            set(j + 2, 1.0 / distance);
            let left = halfway(a, b);
            let right = halfway(b, c);
            let middle = halfway(&left, &right);
            columns.splice(j + 1..j + 2, [left, middle, right]);
        }
    }
    errors.truncate(columns.len());
    errors
}

/// Distance of the curve's middle from the chord between its ends, given the control points.
fn chord_distance(a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let middle = (a + b * 2.0 + c) * 0.25 - a;
    let chord = c - a;
    let length = chord.length();
    let direction = if length > 0.0 {
        chord * (1.0 / length)
    } else {
        Vec3::ZERO
    };
    (middle - direction * middle.dot(direction)).length()
}

fn halfway(a: &[DrawVert], b: &[DrawVert]) -> Vec<DrawVert> {
    a.iter().zip(b).map(|(a, b)| a.halfway(b)).collect()
}

/// Moves every odd point of a line of control points onto the curve; even ones are on it.
fn put_on_curve(line: &mut [DrawVert]) {
    for at in (1..line.len().saturating_sub(1)).step_by(2) {
        if let Some([before, point, after]) = line.get_mut(at - 1..=at + 1) {
            let next = point.halfway(after);
            let previous = point.halfway(before);
            *point = next.halfway(&previous);
        }
    }
}

/// Removes marked inner columns. The column behind a removed one is not looked at, as in the engine.
fn remove_marked(columns: &mut Columns, errors: &mut Vec<f32>) {
    let last = columns.len() - 1;
    let mut skip = false;
    let keep: Vec<bool> = errors
        .iter()
        .enumerate()
        .map(|(at, &error)| {
            let remove = at > 0 && at < last && !skip && error == REMOVE;
            skip = remove;
            !remove
        })
        .collect();
    let mut kept = keep.iter();
    columns.retain(|_| kept.next().copied().unwrap_or(true));
    let mut kept = keep.iter();
    errors.retain(|_| kept.next().copied().unwrap_or(true));
}
