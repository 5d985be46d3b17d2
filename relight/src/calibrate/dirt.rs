//! Ambient occlusion by which a compiler multiplies light, and the rays that measure it.
//!
//! Source: the settings, and their defaults, are q3map2's.

use crate::occluders::Occluders;
use glam::{Vec3, Vec4};
use std::f32::consts::TAU;

/// Rays of the ambient occlusion: angles from the normal, degrees, and rays at each angle.
const DIRT_RINGS: ([f32; 3], u32) = ([14.5, 43.5, 72.5], 16);

/// Smallest part of light that dirt leaves: bounds the division.
const LEAST_PART: f32 = 0.1;

/// Ambient occlusion by which the compiler multiplies all light of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dirt {
    /// Distance within which surfaces occlude, id units.
    pub depth: f32,
    /// Exponent of the occlusion.
    pub gain: f32,
    /// Factor of the occlusion.
    pub scale: f32,
}

impl Dirt {
    /// q3map2's defaults.
    pub const DEFAULT: Dirt = Dirt {
        depth: 128.0,
        gain: 1.0,
        scale: 1.0,
    };

    /// The rays that measure it.
    pub fn surroundings(&self) -> Surroundings {
        let (angles, count) = DIRT_RINGS;
        let around = angles.into_iter().flat_map(|angle| {
            let (out, up) = angle.to_radians().sin_cos();
            (0..count).map(move |k| {
                let (sin, cos) = (k as f32 / count as f32 * TAU).sin_cos();
                Vec4::new(cos, sin, out, up)
            })
        });
        Surroundings {
            rays: around.chain([Vec4::W]).collect(),
            reach: self.depth,
        }
    }

    /// Part of the light that was stored where surfaces are so near ([`Surroundings`]), at least 0.1, so that light can
    /// be divided by it.
    pub(crate) fn part_stored(&self, nearness: f32) -> f32 {
        self.part(nearness).max(LEAST_PART)
    }

    /// Part of the light that is stored where surfaces are so near, 0 to 1.
    pub(crate) fn part(&self, nearness: f32) -> f32 {
        let taken = nearness.powf(self.gain).min(1.0) * self.scale;
        (1.0 - taken).clamp(0.0, 1.0)
    }
}

/// Rays around a point that measure how near surfaces are.
#[derive(Debug, Clone, PartialEq)]
pub struct Surroundings {
    /// For each ray (c, s, a, b): its direction is (c u + s v) a + n b, with the point's normal n and the two vectors
    /// u, v of `n.any_orthonormal_pair()`.
    pub rays: Vec<Vec4>,
    /// Length of the rays, id units.
    pub reach: f32,
}

impl Surroundings {
    /// How near surfaces are: the mean over the rays of 1 − distance over reach. A ray that meets nothing within the
    /// reach, or sky, counts 0.
    pub(crate) fn nearness(&self, occluders: &Occluders, position: Vec3, normal: Vec3) -> f32 {
        let (u, v) = normal.any_orthonormal_pair();
        let mut near = 0.0f32;
        for ray in &self.rays {
            let direction = (u * ray.x + v * ray.y) * ray.z + normal * ray.w;
            let hit = occluders.nearest(position, direction, self.reach);
            near += hit
                .filter(|hit| !hit.sky)
                .map_or(0.0, |hit| 1.0 - hit.t / self.reach);
        }
        near / self.rays.len().max(1) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_occluded_and_open_ground_is_not() {
        let dirt = Dirt::DEFAULT;
        // A wall along y at x = 0, as high as rays go.
        let (a, b, c) = (
            Vec3::new(0.0, -999.0, -999.0),
            Vec3::new(0.0, 999.0, -999.0),
            Vec3::new(0.0, 0.0, 999.0),
        );
        let wall = |sky| Occluders::new(std::iter::once(([a, b, c], sky, 0)));
        let around = dirt.surroundings();
        let part = |occluders: &Occluders, x: f32| {
            dirt.part_stored(around.nearness(occluders, Vec3::new(x, 0.0, 0.0), Vec3::Z))
        };
        let at = |x: f32| part(&wall(false), x);
        assert_eq!(at(129.0), 1.0);
        assert!(at(64.0) < 1.0 && at(16.0) < at(64.0) && at(1.0) < at(16.0));
        // Half of the rays but for the one along the normal meet it at once.
        let half = 24.0 / 49.0;
        assert!((at(1e-3) - (1.0 - half)).abs() < 0.07, "{}", at(1e-3));
        // The sky is far away.
        assert_eq!(part(&wall(true), 1.0), 1.0);
    }
}
