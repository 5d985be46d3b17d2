//! Irradiance of triangle lights at a sample: Lambert's formula for the unshadowed part, shadow rays for the rest.

use super::cutoff::{Contribution, ContributionBucket};
use super::samples::Sample;
use crate::light::{LightRef, TriangleLight};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use support::random::Random;
use support::slice::part;

/// Contribution, as a part of a sample's light, below which a shadow ray is sent at random and weighted by its
/// probability (Russian roulette).
const ROULETTE: f32 = 0.02;

/// Shadow rays to a large triangle.
const RAYS: u32 = 6;

/// Area over squared distance from which a triangle is large, an approximate solid angle, sr.
const LARGE: f32 = 0.15;

/// Contribution of each group of triangle lights at a sample, for strength 1. `of_light`: for every light its group and
/// its radiance relative to the group's.
pub(super) fn contributions(
    world: &RelitWorld,
    occluders: &Occluders,
    sample: &Sample,
    of_light: &[(u32, f32)],
    random: &mut Random,
) -> Vec<ContributionBucket> {
    let mut buckets: Vec<ContributionBucket> = Vec::new();
    let mut one = Contribution::default();
    let scale = sample.level() + sample.floor;
    for &entry in world.light_lists.row(sample.cluster) {
        let LightRef::Triangle(index) = world.light_lists.light(entry) else {
            continue; // a point light has a column of its own
        };
        let (Some(light), Some(&(group, part))) = (
            world.lights.get(index as usize),
            of_light.get(index as usize),
        ) else {
            // While a light style is fitted, the world has no lights, but still its lists.
            continue;
        };
        let geometric = lambert(sample.position, sample.normal, light) / PI;
        let expected = geometric * light.radiance.element_sum() / 3.0;
        if expected <= 0.0 {
            continue;
        }
        let chance = (expected / (scale * ROULETTE)).min(1.0);
        if chance < 1.0 && random.uniform() >= chance {
            continue;
        }
        let seen = visible_part(occluders, sample.position, sample.normal, light, random);
        let number = if light.has_own_cutoff() {
            index
        } else {
            light.surface
        };
        if (one.number, one.group) != (number, group) {
            one.add_to(&mut buckets);
            one = Contribution {
                number,
                group,
                sky: light.is_sky,
                ..Contribution::default()
            };
        }
        one.unshadowed += geometric * part;
        one.arrives += geometric * part * seen / chance;
    }
    one.add_to(&mut buckets);
    buckets.sort_by_key(|bucket| bucket.group);
    buckets
}

/// Visible fraction of a triangle at a point of a surface: one ray to its centroid, or several to a large triangle.
pub(crate) fn visible_part(
    occluders: &Occluders,
    position: Vec3,
    normal: Vec3,
    light: &TriangleLight,
    random: &mut Random,
) -> f32 {
    let [a, b, c] = light.vertices;
    let middle = (a + b + c) / 3.0;
    let clear = |to: Vec3| !occluders.blocked(position, to, false);
    let wide = light.area() > LARGE * middle.distance_squared(position);
    if !wide && normal.dot(middle - position) > 0.0 {
        return f32::from(u8::from(clear(middle)));
    }
    let mut rays = 0.0f32;
    let mut open = 0.0;
    for _ in 0..RAYS * 3 {
        let (u, v) = random.in_triangle();
        let to = a + (b - a) * u + (c - a) * v;
        if normal.dot(to - position) <= 0.0 {
            continue;
        }
        rays += 1.0;
        if clear(to) {
            open += 1.0;
        }
        if rays >= RAYS as f32 {
            break;
        }
    }
    if rays > 0.0 { open / rays } else { 0.0 }
}

/// Irradiance from a triangle of radiance 1 at a point of a surface, clipped at its horizon, without shadows.
///
/// Source: Lambert's formula for polygons: half the sum over the edges of angle times cosine.
pub(crate) fn lambert(position: Vec3, normal: Vec3, light: &TriangleLight) -> f32 {
    let [a, b, c] = light.vertices.map(|v| v - position);
    let facing = -(b - a).cross(c - a).dot(a);
    if facing <= 0.0 && !light.two_sided {
        return 0.0;
    }
    let heights = [a, b, c].map(|v| v.dot(normal));
    if heights.iter().all(|h| *h <= 0.0) {
        return 0.0;
    }
    // Small and distant: the centroid stands for the triangle.
    let middle = (a + b + c) / 3.0;
    let squared = middle.length_squared();
    let extent = (a - middle)
        .length_squared()
        .max((b - middle).length_squared())
        .max((c - middle).length_squared());
    if extent < 0.01 * squared && heights.iter().all(|h| *h > 0.0) {
        let area = (b - a).cross(c - a) * 0.5;
        return middle.dot(normal) * area.dot(middle).abs() / (squared * squared);
    }
    let mut polygon = [Vec3::ZERO; 4];
    let mut count = 0;
    let corners = [(a, heights[0]), (b, heights[1]), (c, heights[2])];
    let next = [corners[1], corners[2], corners[0]];
    for ((from, h0), (to, h1)) in corners.into_iter().zip(next) {
        let mut keep = |p: Vec3| {
            if let Some(slot) = polygon.get_mut(count) {
                *slot = p;
                count += 1;
            }
        };
        if h0 > 0.0 {
            keep(from);
        }
        if (h0 > 0.0) != (h1 > 0.0) {
            keep(from + (to - from) * (h0 / (h0 - h1)));
        }
    }
    let corners = part(&polygon, ..count);
    let mut sum = 0.0;
    for (i, from) in corners.iter().enumerate() {
        let to = corners
            .get(i + 1)
            .or(corners.first())
            .copied()
            .unwrap_or(*from);
        let cross = from.cross(to);
        let length = cross.length();
        if length > 1e-12 {
            let angle = length.atan2(from.dot(to));
            sum += angle * cross.dot(normal) / length;
        }
    }
    (sum.abs() / 2.0).min(TAU / 2.0)
}

/// Solid angle of a triangle light at a position, sr; 0 behind it, unless it is two-sided.
///
/// Source: Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, IEEE TBME 1983.
pub(crate) fn solid_angle(position: Vec3, light: &TriangleLight) -> f32 {
    let [a, b, c] = light.vertices.map(|v| v - position);
    if (b - a).cross(c - a).dot(a) >= 0.0 && !light.two_sided {
        return 0.0;
    }
    let [la, lb, lc] = [a, b, c].map(Vec3::length);
    let above = a.dot(b.cross(c));
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * above.abs().atan2(below)
}

#[cfg(test)]
mod tests {
    use super::super::samples::Site;
    use super::*;
    use crate::light::EmissionSource;

    fn light(vertices: [Vec3; 3], two_sided: bool) -> TriangleLight {
        TriangleLight {
            vertices,
            radiance: Vec3::ONE,
            two_sided,
            surface: 0,
            triangle: 0,
            model: 0,
            is_sky: false,
            source: EmissionSource::SurfaceLight,
        }
    }

    #[test]
    fn irradiance_agrees_with_numerical_integration() {
        let sample = Sample {
            site: Site::Surface,
            position: Vec3::ZERO,
            normal: Vec3::new(0.6, 0.0, 0.8),
            value: Vec3::ZERO,
            shown: Vec3::ZERO,
            bounce: Vec3::ZERO,
            cluster: 0,
            material: u32::MAX,
            saturated: false,
            part: 1.0,
            floor: 0.0,
            trust: 1.0,
            held_out: false,
        };
        // Facing down; one partly below the horizon, one far away, one seen from behind.
        let near = [
            Vec3::new(-50.0, -20.0, 10.0),
            Vec3::new(20.0, 60.0, 10.0),
            Vec3::new(40.0, -20.0, 15.0),
        ];
        let far = near.map(|v| v + Vec3::new(0.0, 0.0, 900.0));
        for vertices in [near, far] {
            let [a, b, c] = vertices;
            let light = light(vertices, false);
            let down = light.normal();
            assert!(down.z < 0.0);
            let mut sum = 0.0;
            let pieces = 400;
            for i in 0..pieces {
                for j in 0..pieces - i {
                    for third in [1.0, 2.0] {
                        if third == 2.0 && j + 1 >= pieces - i {
                            continue;
                        }
                        let (u, v) = (i as f32 + third / 3.0, j as f32 + third / 3.0);
                        let (u, v) = (u / pieces as f32, v / pieces as f32);
                        let p = a + (b - a) * u + (c - a) * v;
                        let d = p.normalize();
                        sum += d.dot(sample.normal).max(0.0) * -d.dot(down) / p.length_squared()
                            * light.area()
                            / (pieces * pieces) as f32;
                    }
                }
            }
            let found = lambert(sample.position, sample.normal, &light);
            assert!((found / sum - 1.0).abs() < 0.01, "{found} {sum}");
        }
        let [a, b, c] = near;
        assert_eq!(
            lambert(sample.position, sample.normal, &light([a, c, b], false)),
            0.0
        );
        assert!(lambert(sample.position, sample.normal, &light([a, c, b], true)) > 0.1);
    }
}
