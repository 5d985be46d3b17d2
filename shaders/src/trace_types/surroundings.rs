//! What a ray may see beside surfaces of the scene: skies, other places through portals, what lies in its way, flares, fog.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A sky material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SkyRecord {
    /// Bindless textures of the box in the order rt bk lf ft up dn, or `NO_TEXTURE`.
    pub faces: [u32; 6],
    /// Height of the clouds, units.
    pub cloud_height: f32,
}

/// A portal or mirror; see `scene::Portal` of the renderer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PortalRecord {
    /// Plane of the surface: `xyz . p = w`.
    pub plane: [f32; 4],
    /// 1: reflects.
    pub mirror: u32,
    /// A point of the plane.
    pub surface_origin: Vec3,
    /// Frame of the plane.
    pub surface_axis: [Vec3; 3],
    /// Where `surface_origin` is seen from.
    pub camera_origin: Vec3,
    /// What the frame of the plane turns to.
    pub camera_axis: [Vec3; 3],
}

/// What lies in the way of light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransportView {
    /// Boxes around the surfaces of the world that colour the light that passes them: smallest and largest corners.
    pub filters: u64,
    /// Boxes around what is translucent in sight of the eye, likewise.
    pub layers: u64,
    /// Boxes around what may show through a sky, likewise.
    pub beyond: u64,
    /// One bit for each surface of the world: it may show through a sky.
    pub beyond_surfaces: u64,
    /// Number of `filters`.
    pub filter_count: u32,
    /// Number of `layers`; all ones: anything may be anywhere.
    pub layer_count: u32,
    /// Number of `beyond`.
    pub beyond_count: u32,
    /// Number of bits in `beyond_surfaces`.
    pub beyond_surface_count: u32,
    /// Mirrors and portals on a path.
    pub max_depth: u32,
    /// Diffuse bounces.
    pub bounces: u32,
}

/// The flares of a view.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FlareView {
    /// [`Flare`](crate::types::Flare)s.
    pub flares: u64,
    /// [`FlareState`](crate::types::FlareState)s, by slot.
    pub states: u64,
    /// Number of flares.
    pub count: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Light in fog: bindless image indices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FogView {
    /// What light in fog is multiplied by to be seen, of each pixel.
    pub weight: u32,
    /// A point in the fog along the way of a pixel and its distance on the way, of each cell.
    pub point: u32,
    /// Light at such points, with the number of frames that it is the mean of.
    pub fresh: u32,
    /// The last frame's.
    pub last: u32,
    /// The light that is shown.
    pub filtered: u32,
    /// Pixels to the edge of a cell.
    pub cell: u32,
    /// Cells.
    pub width: u32,
    /// Cells.
    pub height: u32,
    /// `FOG_*` bits.
    pub flags: u32,
}
