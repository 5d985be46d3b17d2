//! Counts of the rays that meet bodies.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Where rays are counted: by geometry of bodies, and by the boxes of a uniform grid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FeedbackView {
    /// Counters (`u32`): one for each counted geometry, then one for each box.
    pub counters: u64,
    /// Index of the first counted geometry.
    pub first: u32,
    /// Number of counted geometries.
    pub count: u32,
    /// Least corner of the first box.
    pub origin: Vec3,
    /// Edge of a box, units.
    pub edge: f32,
    /// Boxes along each axis, or zeros; x changes fastest, z slowest.
    pub counts: [u32; 3],
    /// Which of `FEEDBACK_RAYS` invocations count the boxes on their rays.
    pub turn: u32,
}
