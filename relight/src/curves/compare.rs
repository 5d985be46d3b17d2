//! Rays and points for comparisons of curves with their tessellations.

use glam::Vec3;
use support::random::Random;

use super::{CurveRay, Piece, SurfaceHit};

/// Distances of the rays' starts from the curves, id units.
const NEAREST: f32 = 8.0;
const FARTHEST: f32 = 128.0;

/// Spread of the points that rays are aimed at, id units.
const SPREAD: f32 = 8.0;

/// Longest distance along a normal at which a surface is looked for, id units.
const REACH: f32 = 64.0;

/// Point and normal of a random place of the pieces.
fn place(pieces: &[Piece], random: &mut Random) -> (Vec3, Vec3) {
    let Some(piece) = pieces.get(random.below(pieces.len().max(1))) else {
        return (Vec3::ZERO, Vec3::Z);
    };
    let (u, v) = (random.uniform(), random.uniform());
    (piece.point(u, v), piece.normal(u, v))
}

/// Rays from points in front of the pieces, half of them in any direction, half of them towards another piece. The same at
/// each call.
pub fn rays_around(pieces: &[Piece], count: usize) -> Vec<CurveRay> {
    let mut random = Random::new(1);
    let ray = |i: usize| {
        let (at, normal) = place(pieces, &mut random);
        let origin = at + normal * (NEAREST + (FARTHEST - NEAREST) * random.uniform());
        let any = random.signed_point();
        let direction = match i % 2 {
            0 => any,
            _ => place(pieces, &mut random).0 + any * SPREAD - origin,
        };
        CurveRay::new(origin, direction)
    };
    (0..count).map(ray).collect()
}

/// Distances of other surfaces from points of curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveErrors {
    /// Number of points.
    pub points: usize,
    /// Number of those from which no surface of the same side lies along the normal.
    pub missed: usize,
    /// Distances along the normal, id units.
    pub distance: Vec<f32>,
    /// Degrees between the exact normal and the shaded one.
    pub normal: Vec<f32>,
    /// Degrees between the exact normal and that of the flat surface.
    pub face: Vec<f32>,
}

/// Errors at points of pieces along their normals; `nearest`: the nearest hit of the other surfaces before a limit.
pub fn errors_along_normals(
    pieces: &[Piece],
    points: usize,
    nearest: impl Fn(&CurveRay, f32) -> Option<SurfaceHit>,
) -> CurveErrors {
    let mut random = Random::new(2);
    let mut errors = CurveErrors::default();
    for _ in 0..points.min(points * pieces.len()) {
        let (at, normal) = place(pieces, &mut random);
        errors.points += 1;
        let along = |direction: Vec3| nearest(&CurveRay::new(at, direction), REACH);
        let hits = [along(normal), along(-normal)].into_iter().flatten();
        let hits = hits.filter(|hit| hit.face.dot(normal) > 0.0);
        let Some(hit) = hits.min_by(|a, b| a.t.total_cmp(&b.t)) else {
            errors.missed += 1;
            continue;
        };
        let degrees = |other: Vec3| normal.angle_between(other).to_degrees();
        errors.distance.push(hit.t);
        errors.normal.push(degrees(hit.normal));
        errors.face.push(degrees(hit.face));
    }
    errors
}
