//! Exact intersection of a ray with a biquadratic Bézier surface.
//!
//! In the ray's frame the surface is a biquadratic function whose first two coordinates vanish at a hit. A part of the
//! surface whose control points lie on one side has no hit (convex hull). A part whose parameters map to these coordinates
//! one to one has at most one, which Newton's method finds; all others are halved by de Casteljau's construction. Sources: Toth, On Ray Tracing Parametric Surfaces, 1985; Nishita,
//! Sederberg and Kakimoto, Ray Tracing Trimmed Rational Surface Patches, 1990.

use glam::{Vec2, Vec3, Vec3Swizzles};
use support::Aabb;

use super::tree::{CurveRay, Shape, SurfaceHit};

/// Halvings after which a part is taken for its middle: a 4096th of the surface along both parameters.
const MOST_HALVINGS: u32 = 24;

/// Points that Newton's method evaluates; a part for which they do not suffice is halved.
const MOST_STEPS: u32 = 9;

/// Distance from the ray from which Newton's method takes one more step, id units.
const CLOSE: f32 = 1.0e-4;

/// Parameters of the surface beyond the end of a part that still belong to it, so that no ray passes between two parts.
const BEYOND: f32 = 1.0e-4;

/// Three by three control points.
type Net = [[Vec3; 3]; 3];

/// A biquadratic Bézier surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Control points, rows along v of columns along u. The front is the side of du × dv.
    pub points: Net,
}

/// Bernstein polynomials of degree two.
fn weights(x: f32) -> [f32; 3] {
    let y = 1.0 - x;
    [y * y, 2.0 * x * y, x * x]
}

/// Their derivatives.
fn slopes(x: f32) -> [f32; 3] {
    [2.0 * x - 2.0, 2.0 - 4.0 * x, 2.0 * x]
}

fn sum(net: &Net, along_u: [f32; 3], along_v: [f32; 3]) -> Vec3 {
    let row = |points: &[Vec3; 3]| {
        points[0] * along_u[0] + points[1] * along_u[1] + points[2] * along_u[2]
    };
    row(&net[0]) * along_v[0] + row(&net[1]) * along_v[1] + row(&net[2]) * along_v[2]
}

/// Point and derivatives along u and v.
fn evaluate(net: &Net, u: f32, v: f32) -> [Vec3; 3] {
    let (wu, wv) = (weights(u), weights(v));
    [
        sum(net, wu, wv),
        sum(net, slopes(u), wv),
        sum(net, wu, slopes(v)),
    ]
}

/// Both halves of a row of control points (de Casteljau).
fn halves([a, b, c]: [Vec3; 3]) -> [[Vec3; 3]; 2] {
    let (ab, bc) = ((a + b) * 0.5, (b + c) * 0.5);
    let middle = (ab + bc) * 0.5;
    [[a, ab, middle], [middle, bc, c]]
}

fn transposed(net: &Net) -> Net {
    [0, 1, 2].map(|i| [net[0][i], net[1][i], net[2][i]])
}

fn halved_along_u(net: &Net) -> [Net; 2] {
    let rows = net.map(halves);
    [0, 1].map(|side| rows.map(|row| row[side]))
}

fn halved_along_v(net: &Net) -> [Net; 2] {
    halved_along_u(&transposed(net)).map(|half| transposed(&half))
}

/// A part of a surface in the frame of a ray.
#[derive(Clone, Copy)]
struct Part {
    net: Net,
    /// First parameters, and their range.
    from: Vec2,
    size: Vec2,
    halvings: u32,
}

impl Part {
    fn halved(&self) -> [Self; 2] {
        let length = |net: &Net| {
            let ends = net.map(|row| (row[2] - row[0]).length_squared());
            ends.into_iter().fold(0.0, f32::max)
        };
        let along_u = length(&self.net) >= length(&transposed(&self.net));
        let nets = if along_u {
            halved_along_u(&self.net)
        } else {
            halved_along_v(&self.net)
        };
        let half = if along_u {
            Vec2::new(0.5, 1.0)
        } else {
            Vec2::new(1.0, 0.5)
        };
        let size = self.size * half;
        let step = self.size - size;
        [(nets[0], self.from), (nets[1], self.from + step)].map(|(net, from)| Self {
            net,
            from,
            size,
            halvings: self.halvings + 1,
        })
    }

    /// Whether no two parameters map to the same first two coordinates: with the mean of all control differences as the unit
    /// of both axes, the symmetric part of the Jacobian is positive definite everywhere.
    fn is_unfolded(&self) -> bool {
        let along_u = |net: &Net| net.map(|row| [row[1] - row[0], row[2] - row[1]].map(|d| d.xy()));
        let (du, dv) = (along_u(&self.net), along_u(&transposed(&self.net)));
        let mean = |all: &[[Vec2; 2]; 3]| all.iter().flatten().sum::<Vec2>();
        let (mean_u, mean_v) = (mean(&du), mean(&dv));
        let turn = mean_u.perp_dot(mean_v);
        let inside = |d: &Vec2| Vec2::new(d.perp_dot(mean_v), mean_u.perp_dot(*d)) / turn;
        let (mut least_u, mut least_v) = (f32::INFINITY, f32::INFINITY);
        let (mut beside_u, mut beside_v) = (0.0f32, 0.0f32);
        for d in du.iter().flatten().map(inside) {
            least_u = least_u.min(d.x);
            beside_u = beside_u.max(d.y.abs());
        }
        for d in dv.iter().flatten().map(inside) {
            least_v = least_v.min(d.y);
            beside_v = beside_v.max(d.x.abs());
        }
        let beside = beside_u + beside_v;
        least_u > 0.0 && least_v > 0.0 && 4.0 * least_u * least_v > beside * beside
    }

    /// The parameters of the hit by Newton's method, if it lies in this part. `None`: it does not converge, or to a point
    /// outside, where the surface may fold.
    fn hit(&self) -> Option<(f32, Vec2)> {
        let mut at = Vec2::splat(0.5);
        let mut close = false;
        for _ in 0..MOST_STEPS {
            let [point, du, dv] = evaluate(&self.net, at.x, at.y);
            if close {
                let beyond = BEYOND / self.size;
                let inside = at.cmpge(-beyond) & at.cmple(1.0 + beyond);
                return inside.all().then_some((point.z, at));
            }
            close = point.xy().length_squared() < CLOSE * CLOSE;
            let turn = du.xy().perp_dot(dv.xy());
            let off = point.xy();
            at -= Vec2::new(off.perp_dot(dv.xy()), du.xy().perp_dot(off)) / turn;
            if !at.is_finite() || at.abs().max_element() > 4.0 {
                return None;
            }
        }
        None
    }
}

impl Piece {
    /// The point at the parameters u and v, from 0 to 1.
    pub fn point(&self, u: f32, v: f32) -> Vec3 {
        evaluate(&self.points, u, v)[0]
    }

    /// Unit normal on the front. Where the surface has none, as at a corner of no angle, that beside it.
    pub fn normal(&self, u: f32, v: f32) -> Vec3 {
        let mut at = Vec2::new(u, v);
        for _ in 0..4 {
            let [_, du, dv] = evaluate(&self.points, at.x, at.y);
            let normal = du.cross(dv);
            if normal.length_squared() > 1.0e-6 * du.length_squared() * dv.length_squared() {
                return normal.normalize_or(Vec3::Z);
            }
            at = at.lerp(Vec2::splat(0.5), 0.01);
        }
        Vec3::Z
    }

    /// Largest distance of a control point from where a flat surface with evenly spaced parameters would have it, id units.
    pub fn curvature(&self) -> f32 {
        let bent = |[a, b, c]: [Vec3; 3]| ((a + c) * 0.5).distance(b);
        let nets = [self.points, transposed(&self.points)];
        nets.iter()
            .flatten()
            .map(|row| bent(*row))
            .fold(0.0, f32::max)
    }

    /// The same surface in `2 ^ levels` parts along each parameter.
    pub fn split(&self, levels: u32) -> Vec<Self> {
        let mut nets = vec![self.points];
        for _ in 0..levels {
            nets = nets.iter().flat_map(halved_along_u).collect();
            nets = nets.iter().flat_map(halved_along_v).collect();
        }
        nets.into_iter().map(|points| Self { points }).collect()
    }

    /// The nearest hit before `limit`: distance and parameters.
    pub fn intersect(&self, ray: &CurveRay, limit: f32) -> Option<(f32, Vec2)> {
        let [x, y] = ray.across;
        let place = |p: Vec3| {
            let p = p - ray.origin;
            Vec3::new(p.dot(x), p.dot(y), p.dot(ray.direction))
        };
        let whole = Part {
            net: self.points.map(|row| row.map(place)),
            from: Vec2::ZERO,
            size: Vec2::ONE,
            halvings: 0,
        };
        let mut stack = [whole; MOST_HALVINGS as usize + 2];
        let mut depth = 1;
        let mut best: Option<(f32, Vec2)> = None;
        while depth > 0 {
            depth -= 1;
            let part = stack[depth];
            let bounds = Aabb::of(part.net.into_iter().flatten());
            let last = best.map_or(limit, |hit| hit.0);
            let misses = bounds.mins.xy().max_element() > CLOSE
                || bounds.maxs.xy().min_element() < -CLOSE
                || bounds.maxs.z < 0.0
                || bounds.mins.z >= last;
            if misses {
                continue;
            }
            let unfolded = part.is_unfolded();
            let mut found = if unfolded { part.hit() } else { None };
            if found.is_none() && part.halvings < MOST_HALVINGS {
                let [near, far] = part.halved();
                let first = |part: &Part| {
                    let points = part.net.iter().flatten();
                    points.map(|p| p.z).fold(f32::INFINITY, f32::min)
                };
                let in_order = first(&near) <= first(&far);
                let pair = if in_order { [far, near] } else { [near, far] };
                for part in pair {
                    stack[depth] = part;
                    depth += 1;
                }
                continue;
            }
            if found.is_none() && !unfolded {
                // the ray touches the surface, or meets a point where it has no normal
                let middle = evaluate(&part.net, 0.5, 0.5)[0];
                let meets = middle.xy().length_squared() < CLOSE * CLOSE;
                found = meets.then_some((middle.z, Vec2::splat(0.5)));
            }
            if let Some((t, at)) = found.filter(|&(t, _)| t >= 0.0 && t < last) {
                let at = (part.from + at * part.size).clamp(Vec2::ZERO, Vec2::ONE);
                best = Some((t, at));
            }
        }
        best
    }
}

impl Shape for Piece {
    fn bounds(&self) -> Aabb {
        Aabb::of(self.points.into_iter().flatten())
    }

    fn nearest(&self, ray: &CurveRay, limit: f32) -> Option<SurfaceHit> {
        let (t, at) = self.intersect(ray, limit)?;
        let normal = self.normal(at.x, at.y);
        Some(SurfaceHit {
            t,
            face: normal,
            normal,
        })
    }
}
