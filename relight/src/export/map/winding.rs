//! The polygons of a brush's sides: what is left of each plane between all the others.

use glam::DVec3;
use q3bsp::{Brush, Bsp, ShaderId};

/// Half the size of the polygon that a plane begins with, id units: larger than any world.
const EXTENT: f64 = 262_144.0;

/// Nearer to a plane than this is on it, id units.
const ON_PLANE: f64 = 0.01;

/// Half the distance of points that say the plane of a small side, id units.
const SPREAD: f64 = 128.0;

/// A plane that lies nearer than this to a side's corners is the side's, id units.
const EXACT: f64 = 2e-3;

/// A normal this near to an axis is the axis for compilers, sine of the angle.
const AXIAL: f64 = 3e-5;

/// A side that bounds its brush.
pub(super) struct Side {
    /// Unit normal, outwards.
    pub normal: DVec3,
    /// Shader.
    pub shader: ShaderId,
    /// Corners, clockwise seen from outside.
    pub winding: Vec<DVec3>,
}

/// The sides of a brush that bound it; sides that only helped the compiler's collision (bevels) touch it in an edge or
/// not at all, and are left out. `None` for a brush that is not closed, or whose planes are not numbers.
pub(super) fn sides(bsp: &Bsp, brush: &Brush) -> Option<Vec<Side>> {
    let mut planes: Vec<(DVec3, f64, ShaderId)> = Vec::new();
    for side in bsp.sides_of(brush) {
        let plane = bsp.plane(side.plane);
        let normal = plane.normal.as_dvec3();
        let length = normal.length();
        if !(length > 0.5 && length.is_finite() && plane.dist.is_finite()) {
            return None;
        }
        let (normal, dist) = (normal / length, f64::from(plane.dist) / length);
        let same = |other: &&(DVec3, f64, ShaderId)| {
            other.0.dot(normal) > 0.999_999 && (other.1 - dist).abs() < ON_PLANE
        };
        if !planes.iter().any(|other| same(&other)) {
            planes.push((normal, dist, side.shader));
        }
    }
    let mut out = Vec::new();
    for (at, &(normal, dist, shader)) in planes.iter().enumerate() {
        let mut winding = whole_plane(normal, dist);
        for (other, &(n, d, _)) in planes.iter().enumerate() {
            if other == at || (at < other && n.dot(normal) > 0.0 && lies_on(&winding, n, d)) {
                // Of sides in one plane the first stays.
                continue;
            }
            winding = clip(&winding, n, d);
        }
        winding.dedup_by(|a, b| a.distance(*b) < ON_PLANE);
        while winding.len() > 1 && ends_meet(&winding) {
            winding.pop();
        }
        let open = winding.iter().any(|p| p.abs().max_element() > EXTENT / 2.0);
        if open {
            return None;
        }
        if winding.len() >= 3 && area(&winding) > ON_PLANE {
            out.push(Side {
                normal,
                shader,
                winding,
            });
        }
    }
    (out.len() >= 4).then_some(out)
}

fn ends_meet(winding: &[DVec3]) -> bool {
    match (winding.first(), winding.last()) {
        (Some(first), Some(last)) => first.distance(*last) < ON_PLANE,
        _ => false,
    }
}

/// A square on a plane, clockwise seen from its front.
fn whole_plane(normal: DVec3, dist: f64) -> Vec<DVec3> {
    let u = normal.any_orthonormal_vector();
    let v = u.cross(normal);
    let corner = |a: f64, b: f64| normal * dist + (u * a + v * b) * EXTENT;
    let mut winding = vec![
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ];
    if clockwise_normal(&winding).dot(normal) < 0.0 {
        winding.reverse();
    }
    winding
}

/// Twice the area times the normal of the side that a polygon is clockwise from.
fn clockwise_normal(winding: &[DVec3]) -> DVec3 {
    let Some(&origin) = winding.first() else {
        // Nothing of the side was left by clipping.
        return DVec3::ZERO;
    };
    let pairs = winding.iter().zip(winding.iter().skip(1));
    pairs.map(|(&a, &b)| (b - origin).cross(a - origin)).sum()
}

fn area(winding: &[DVec3]) -> f64 {
    clockwise_normal(winding).length() / 2.0
}

/// Whether a polygon lies on a plane; not one of no corners.
fn lies_on(winding: &[DVec3], normal: DVec3, dist: f64) -> bool {
    let mut heights = winding.iter().map(|p| (normal.dot(*p) - dist).abs());
    !winding.is_empty() && heights.all(|height| height <= ON_PLANE)
}

/// The part of a polygon behind a plane.
fn clip(winding: &[DVec3], normal: DVec3, dist: f64) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(winding.len() + 1);
    let next = winding.iter().cycle().skip(1);
    for (&a, &b) in winding.iter().zip(next) {
        let (da, db) = (normal.dot(a) - dist, normal.dot(b) - dist);
        if da <= ON_PLANE {
            out.push(a);
        }
        if (da > ON_PLANE && db < -ON_PLANE) || (da < -ON_PLANE && db > ON_PLANE) {
            out.push(a + (b - a) * (da / (da - db)));
        }
    }
    // What only touches the plane is no area.
    let inside = out.iter().any(|p| normal.dot(*p) - dist < -ON_PLANE);
    if inside { out } else { Vec::new() }
}

/// Three points that say the plane of a side, moved by an origin, clockwise seen from outside.
///
/// Corners are what editors write, and whole ones read best; but of small sides, or where rounding tilts the plane,
/// points farther apart say it better.
pub(super) fn plane_points(side: &Side, origin: DVec3) -> [DVec3; 3] {
    let corners = three_corners(&side.winding).map(|p| p + origin);
    let [a, b, c] = corners;
    let spread = {
        let (u, v) = (b - a, c - a);
        let middle = (a + b + c) / 3.0;
        // Clockwise from outside, as the corners are.
        let along = if u.length() > v.length() { u } else { v };
        let along = along.normalize_or(side.normal.any_orthonormal_vector()) * SPREAD;
        let across = along.cross(side.normal);
        [
            middle - along - across,
            middle + along - across,
            middle + across,
        ]
    };
    let mut best = (f64::INFINITY, corners);
    for points in [corners.map(snapped), corners, spread] {
        let points = flat(points);
        let error = off_plane(points, side, origin);
        if error < EXACT {
            return points;
        }
        if error < best.0 {
            best = (error, points);
        }
    }
    best.1
}

/// The farthest that a side's corners are from the plane of three points; infinite for points that face the other way.
fn off_plane([a, b, c]: [DVec3; 3], side: &Side, origin: DVec3) -> f64 {
    let normal = (a - b).cross(c - b).normalize_or_zero();
    if normal.dot(side.normal) < 0.5 {
        return f64::INFINITY;
    }
    let corners = side.winding.iter();
    let off = corners.map(|&p| (p + origin - a).dot(normal).abs());
    // The tilt moves what lies farther away.
    off.fold(0.0, f64::max) + normal.cross(side.normal).length() * SPREAD
}

/// What is nearly whole is whole, as it was in the editor.
fn snapped(p: DVec3) -> DVec3 {
    let whole = p.round();
    DVec3::select((p - whole).abs().cmplt(DVec3::splat(0.01)), whole, p)
}

/// Points of a plane that is nearly an axial one, on that: the axes of a side jump there, and compilers would not agree
/// on which they are.
fn flat(points: [DVec3; 3]) -> [DVec3; 3] {
    let [a, b, c] = points;
    let normal = (a - b).cross(c - b).normalize_or_zero();
    let mean = (a + b + c) / 3.0;
    let mut out = points;
    for axis in 0..3 {
        let others = normal.length_squared() - normal[axis] * normal[axis];
        if normal[axis].abs() > 0.5 && others < AXIAL * AXIAL {
            for p in &mut out {
                p[axis] = snapped(mean)[axis];
            }
        }
    }
    out
}

/// Three corners of a polygon that span it best.
fn three_corners(winding: &[DVec3]) -> [DVec3; 3] {
    let mut best = ([DVec3::ZERO; 3], -1.0);
    for (i, &a) in winding.iter().enumerate() {
        for (j, &b) in winding.iter().enumerate().skip(i + 1) {
            for &c in winding.iter().skip(j + 1) {
                let span = (b - a).cross(c - a).length();
                if span > best.1 {
                    best = ([a, b, c], span);
                }
            }
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_that_is_nearly_a_floor_is_one() {
        let points = [
            DVec3::new(0.0, 0.0, 16.2),
            DVec3::new(0.0, 4096.0, 16.203),
            DVec3::new(4096.0, 0.0, 16.2),
        ];
        assert!(flat(points).iter().all(|p| p.z == flat(points)[0].z));
        let slope = [DVec3::ZERO, DVec3::Y * 64.0, DVec3::new(64.0, 0.0, 1.0)];
        assert_eq!(flat(slope), slope);
    }

    #[test]
    fn the_plane_of_a_small_side_is_not_tilted_by_rounding() {
        let normal = DVec3::new(1.0, 2.0, 3.0).normalize();
        let (u, v) = (normal.any_orthonormal_vector(), DVec3::ZERO);
        let v = v + u.cross(normal);
        // Half a unit wide, near whole numbers.
        let at = DVec3::new(99.995, -3.0, 8.006);
        let mut winding = vec![at, at + u * 0.5, at + (u + v) * 0.5, at + v * 0.5];
        if clockwise_normal(&winding).dot(normal) < 0.0 {
            winding.reverse();
        }
        let side = Side {
            normal,
            shader: ShaderId::from_raw(0),
            winding,
        };
        let origin = DVec3::new(10.0, 20.0, 30.0);
        let points = plane_points(&side, origin);
        assert!(off_plane(points, &side, origin) < EXACT, "{points:?}");
    }
}
