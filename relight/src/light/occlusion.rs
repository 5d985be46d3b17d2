//! Occlusion tests for a map's light.

use glam::Vec3;

use crate::occluders::Occluders;
use crate::world::RelitWorld;

/// Everything static that stops light: opaque surfaces, solid texels of cut-outs, and sky.
pub struct Occlusion(Occluders);

impl Occlusion {
    /// The occluders of a world.
    pub fn new(world: &RelitWorld) -> Self {
        Self(Occluders::of_world(world))
    }

    /// Whether a segment is unobstructed. `last`: the occluder of an earlier ray, which is tested first.
    pub fn is_free(&self, from: Vec3, to: Vec3, last: &mut Option<u32>) -> bool {
        !self.0.blocked_hinted(from, to, last)
    }

    /// Whether the nearest hit of a ray is sky, within `f32` precision.
    pub fn sees_sky(&self, from: Vec3, direction: Vec3) -> bool {
        let hit = self.0.nearest(from, direction, f32::INFINITY);
        hit.is_some_and(|hit| hit.sky)
    }
}

impl std::fmt::Debug for Occlusion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Occlusion").finish_non_exhaustive()
    }
}
