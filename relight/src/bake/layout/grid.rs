//! Coordinates of a curved patch: along its arcs, at its control points.
//!
//! The engine tessellates coordinates as it does positions, so a coordinate is a Bézier curve of the control points' ones.
//! Even control points lie on the surface and get the arc length up to them. The one between two of them is placed so that
//! the texels are equally dense at both ends of the piece: P'(0) = 2 (P1 - P0) and P'(1) = 2 (P2 - P1).

use glam::{Vec2, Vec3};

/// Straight pieces that an arc is measured by.
const PIECES: usize = 16;

/// Length of the Bézier curve of three points.
fn arc([a, b, c]: [Vec3; 3]) -> f32 {
    let at = |t: f32| a * ((1.0 - t) * (1.0 - t)) + b * (2.0 * t * (1.0 - t)) + c * (t * t);
    let steps = (0..PIECES).map(|i| {
        let t = |i: usize| i as f32 / PIECES as f32;
        at(t(i)).distance(at(t(i + 1)))
    });
    steps.sum()
}

/// Places of `count` control points along an axis, from 0 to the length that the function returns last. `point(line, i)`:
/// control point `i` of one of `lines` lines across.
fn places(count: usize, lines: usize, point: impl Fn(usize, usize) -> Vec3) -> Vec<f32> {
    // A control point on an odd line is not on the surface; the curve there is the mean with its neighbours.
    let on_surface = |line: usize, i: usize| match line % 2 {
        1 => (point(line - 1, i) + 2.0 * point(line, i) + point(line + 1, i)) / 4.0,
        _ => point(line, i),
    };
    let mut places = vec![0.0; count];
    let mut length = 0.0f32;
    for start in (0..count.saturating_sub(2)).step_by(2) {
        let (mut longest, mut middle) = (0.0f32, 0.5f32);
        for line in 0..lines {
            let curve = [0, 1, 2].map(|i| on_surface(line, start + i));
            let whole = arc(curve);
            if whole > longest {
                longest = whole;
                let (first, second) = (curve[0].distance(curve[1]), curve[1].distance(curve[2]));
                middle = first / (first + second);
            }
        }
        let middle = if middle.is_finite() { middle } else { 0.5 };
        if let Some([_, between, end]) = places.get_mut(start..start + 3) {
            *between = length + longest * middle;
            *end = length + longest;
        }
        length += longest;
    }
    places
}

/// A patch laid flat: places of its control points in units along its arcs. The patch has odd numbers of columns and rows,
/// at least 3; otherwise `None`.
pub(super) fn flatten(columns: usize, points: &[Vec3]) -> Option<Vec<Vec2>> {
    let rows = points.len().checked_div(columns)?;
    let odd = |n: usize| n >= 3 && n % 2 == 1;
    if !odd(columns) || !odd(rows) || columns * rows != points.len() {
        return None;
    }
    let point = |row: usize, column: usize| {
        let at = points.get(row * columns + column);
        at.copied().unwrap_or(Vec3::ZERO)
    };
    let across = places(columns, rows, point);
    let down = places(rows, columns, |column, row| point(row, column));
    let flat: Vec<Vec2> = (down.iter())
        .flat_map(|y| across.iter().map(|x| Vec2::new(*x, *y)))
        .collect();
    flat.iter().all(|p| p.is_finite()).then_some(flat)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a cylinder of radius 64 and height 32, as editors make it.
    fn quarter() -> Vec<Vec3> {
        let corner = [(64., 0.), (64., 64.), (0., 64.)];
        let row = |z: f32| corner.map(|(x, y)| Vec3::new(x, y, z));
        [row(0.0), row(16.0), row(32.0)].concat()
    }

    #[test]
    fn lengths_are_those_of_the_arcs() {
        let flat = flatten(3, &quarter()).unwrap();
        // 103.9 is the length of this parabola, 100.5 that of the circle that it stands for
        assert!((flat[8].x - 103.9).abs() < 0.3, "{}", flat[8]);
        assert!((flat[8].y - 32.0).abs() < 1e-3);
        assert_eq!(flat[1].x, flat[2].x / 2.0);
    }

    #[test]
    fn texels_are_equally_dense_at_both_ends_of_an_uneven_piece() {
        let mut points = quarter();
        for row in points.chunks_mut(3) {
            row[2].x -= 128.0;
        }
        let flat = flatten(3, &points).unwrap();
        let start = flat[1].x / points[0].distance(points[1]);
        let end = (flat[2].x - flat[1].x) / points[1].distance(points[2]);
        assert!((start - end).abs() < 1e-3, "{start} {end}");
    }

    #[test]
    fn a_patch_that_is_a_point_has_no_size() {
        let flat = flatten(3, &[Vec3::ONE; 9]).unwrap();
        assert!(flat.iter().all(|p| *p == Vec2::ZERO));
        assert_eq!(flatten(3, &[Vec3::ONE; 6]), None);
        assert_eq!(flatten(0, &[]), None);
    }
}
