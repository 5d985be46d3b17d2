//! What is in the way of a map's light.

use glam::Vec3;

use crate::occluders::Occluders;
use crate::world::RelitWorld;

/// What stops light in a map: all that does not move, cut-outs where these are there, and skies.
pub struct Occlusion(Occluders);

impl Occlusion {
    /// Of a world.
    pub fn new(world: &RelitWorld) -> Self {
        Self(Occluders::of_world(world))
    }

    /// Whether nothing is between two points. `last`: what was in the way of an earlier ray, which is asked first.
    pub fn is_free(&self, from: Vec3, to: Vec3, last: &mut Option<u32>) -> bool {
        !self.0.blocked_hinted(from, to, last)
    }

    /// Whether the first thing in a direction is a sky, within what a float can tell.
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
