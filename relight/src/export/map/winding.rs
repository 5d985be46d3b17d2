//! The polygons of a brush's sides: what is left of each plane between all the others.

use glam::DVec3;
use q3bsp::{Brush, Bsp};

/// Half the size of the polygon that a plane begins with, id units: larger than any world.
const EXTENT: f64 = 262_144.0;

/// Nearer to a plane than this is on it, id units.
const ON_PLANE: f64 = 0.01;

/// A side that bounds its brush.
pub(super) struct Side {
    /// Unit normal, outwards.
    pub normal: DVec3,
    /// Shader index.
    pub shader: i32,
    /// Corners, clockwise seen from outside.
    pub winding: Vec<DVec3>,
}

/// The sides of a brush that bound it; sides that only helped the compiler's collision (bevels) touch it in an edge or
/// not at all, and are left out. `None` for a brush that is not closed, or whose planes are not numbers.
pub(super) fn sides(bsp: &Bsp, brush: &Brush) -> Option<Vec<Side>> {
    let mut planes: Vec<(DVec3, f64, i32)> = Vec::new();
    for side in bsp.sides_of(brush) {
        let plane = bsp.plane_of(side)?;
        let normal = plane.normal.as_dvec3();
        let length = normal.length();
        if !(length > 0.5 && length.is_finite() && plane.dist.is_finite()) {
            return None;
        }
        let (normal, dist) = (normal / length, f64::from(plane.dist) / length);
        let same = |other: &&(DVec3, f64, i32)| {
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
            if other != at {
                winding = clip(&winding, n, d);
            }
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
        return DVec3::ZERO;
    };
    let pairs = winding.iter().zip(winding.iter().skip(1));
    pairs.map(|(&a, &b)| (b - origin).cross(a - origin)).sum()
}

fn area(winding: &[DVec3]) -> f64 {
    clockwise_normal(winding).length() / 2.0
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

/// Three corners of a polygon that span it best.
pub(super) fn three_points(winding: &[DVec3]) -> [DVec3; 3] {
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
