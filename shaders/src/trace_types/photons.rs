//! Caustics: the bodies that photons are aimed at, photons, and the cells of the grid that holds them.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A triangle of a refracting body.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BodyTriangle {
    /// Clockwise from the front.
    pub corners: [Vec3; 3],
    /// Part of the area of all triangles that this one and those before it have.
    pub until: f32,
    /// 1: photons start on both sides; 0: on the front.
    pub two_sided: u32,
}

/// A photon where it has landed.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Photon {
    /// The point.
    pub position: Vec3,
    /// Number of the next photon in its cell plus one; 0: the last.
    pub next: u32,
    /// Flux divided by pi, in units of radiance times square units; zero: it has not landed.
    pub flux: Vec3,
    /// Geometric normal on the side that it hit, packed.
    pub normal: u32,
    /// Its direction, packed.
    pub direction: u32,
}

/// A cell of the hash grid of photons.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonCell {
    /// Number of its first photon plus one; 0: none.
    pub first: u32,
    /// Number of its photons.
    pub count: u32,
}

/// Photons of a frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonView {
    /// [`BodyTriangle`]s.
    pub bodies: u64,
    /// Boxes around them: smallest and largest corners.
    pub boxes: u64,
    /// [`Photon`]s.
    pub photons: u64,
    /// [`PhotonCell`]s.
    pub cells: u64,
    /// Number of `bodies`.
    pub body_count: u32,
    /// Number of `boxes`.
    pub box_count: u32,
    /// Number of `photons`, a multiple of `PHOTON_ROW`.
    pub count: u32,
    /// Number of `cells`, a power of two.
    pub cell_count: u32,
    /// Area of all `bodies`, square units.
    pub area: f32,
    /// Kernel radius, units.
    pub radius: f32,
}
