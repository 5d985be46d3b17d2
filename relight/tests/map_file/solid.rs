//! The solid that a compiler makes of a brush: each plane's polygon, cut by all other planes.

use super::read::Face;
use glam::DVec3;

/// Nearer to a plane than this is on it, id units.
const ON: f64 = 0.005;

/// The polygon of each face, in their order; empty where nothing is left.
pub fn polygons(faces: &[Face]) -> Vec<Vec<DVec3>> {
    let polygon = |at: usize| {
        let mut polygon = square(faces[at].normal, faces[at].dist);
        for (other, face) in faces.iter().enumerate() {
            if other != at {
                polygon = behind(&polygon, face.normal, face.dist);
            }
        }
        polygon
    };
    (0..faces.len()).map(polygon).collect()
}

/// A square of the size of any world on a plane.
fn square(normal: DVec3, dist: f64) -> Vec<DVec3> {
    let (u, v) = normal.any_orthonormal_pair();
    let (u, v) = (u * 200_000.0, v * 200_000.0);
    let middle = normal * dist;
    vec![
        middle - u - v,
        middle + u - v,
        middle + u + v,
        middle - u + v,
    ]
}

fn behind(polygon: &[DVec3], normal: DVec3, dist: f64) -> Vec<DVec3> {
    let height = |p: DVec3| p.dot(normal) - dist;
    let mut out = Vec::new();
    for (at, &a) in polygon.iter().enumerate() {
        let b = polygon[(at + 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if ha <= ON {
            out.push(a);
        }
        if (ha > ON) != (hb > ON) && (ha - hb).abs() > 1e-12 {
            out.push(a.lerp(b, ha / (ha - hb)));
        }
    }
    out
}

/// Normal times twice the area, along the face's normal for the squares above.
pub fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for (at, a) in polygon.iter().enumerate() {
        sum += a.cross(polygon[(at + 1) % polygon.len()]);
    }
    sum
}

/// Whether a place on its plane is inside a polygon or on its edge.
pub fn contains(polygon: &[DVec3], normal: DVec3, place: DVec3) -> bool {
    let around = area_vector(polygon).dot(normal).signum();
    let mut pairs = polygon.iter().zip(polygon.iter().cycle().skip(1));
    polygon.len() >= 3
        && pairs.all(|(&a, &b)| {
            let inwards = normal.cross(b - a) * around;
            (place - a).dot(inwards) >= -0.25 * inwards.length()
        })
}
