//! Lights, and the lists that they are sampled from.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A triangle that gives light from the side where its corners go round counter-clockwise.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TriangleLight {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Radiance, the same in all directions.
    pub radiance: Vec3,
    /// `LIGHT_*` bits.
    pub flags: u32,
    /// L without shadows below which it gives nothing; 0 for a light without an end.
    pub end: f32,
}

/// A small sphere that gives light: a point light of the map or a dynamic light of the game.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SphereLight {
    /// Centre.
    pub origin: Vec3,
    /// Radius, above 0.
    pub radius: f32,
    /// Radiance of its surface.
    pub radiance: Vec3,
    /// What lies nearer to the centre than this casts no shadow (the model that carries the light).
    pub clearance: f32,
    /// Direction of a spot.
    pub axis: Vec3,
    /// Cosine of the angle to `axis` up to which a spot shines in full; -1 for no spot.
    pub cos_inner: f32,
    /// Cosine of the angle to `axis` from which on it is dark; -2 for no spot.
    pub cos_outer: f32,
    /// Radius of the ball of glowing gas that the sphere stands for: nearer to the centre than this it gives no more
    /// light than here. 0: there is none.
    pub core: f32,
    /// Where light that falls off linearly ends; 0 for light that falls off with the square of the distance.
    pub reach: f32,
    /// L without shadows below which it gives nothing; 0 for a light without an end.
    pub end: f32,
}

/// A far disc of light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SunLight {
    /// Unit vector towards its middle.
    pub direction: Vec3,
    /// Cosine of its angular radius.
    pub cos_angle: f32,
    /// Irradiance of a surface that faces it, divided by pi: what a white diffuse surface shows.
    pub irradiance: Vec3,
}

/// What choosing a light needs to know about it, without reading all of it: a ball around it and what leaves it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightBounds {
    /// Centre: of a triangle its centroid, so that it lies in the triangle's plane.
    pub centre: Vec3,
    /// Nothing of the light lies farther from the centre.
    pub radius: f32,
    /// Of a triangle: normal of the emitting side times area times luminance of the radiance. Of a sphere: direction of
    /// a spot times the cosine from which on it is dark, shifted by 2 so that it is never zero; zero without a spot.
    pub axis: Vec3,
    /// Of a sphere the luminance of its radiant intensity, above 0; of a triangle 0, or -1 if both sides shine.
    pub omni_intensity: f32,
}

/// A slot of a row's alias table: two lights, of which a number in [0, 1) picks the first below `threshold`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightSlot {
    /// The light that the slot is for: each of a row's lights has one slot.
    pub light: u32,
    /// The other light.
    pub alias: u32,
    /// Chance of the first, given the slot.
    pub threshold: f32,
    /// Chance of the first when a slot is drawn evenly from the row.
    pub chance: f32,
    /// The same of the other light.
    pub alias_chance: f32,
    /// About which part of the light reaches the row's cluster, above 0.
    pub visibility: f32,
    /// The same of the other light.
    pub alias_visibility: f32,
    /// Makes the size a power of two, so that a slot lies in one sector of a cache line.
    pub padding: u32,
}

/// The list of a cell for normals about one way: slots from `first` on.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct LightRow {
    /// First slot.
    pub first: u32,
    /// Number of slots: strong lights first.
    pub count: u32,
    /// Number of strong lights. The others have slots of their own after those of the row, to pick among them alone.
    pub strong: u32,
    /// 1 if suns can reach the cell.
    pub suns: u32,
    /// The cluster that the cell is a piece of; more than there are: none.
    pub cluster: u32,
}

/// The list of a cluster among the lights of this frame: entries of `LightView::dynamic_lights`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct DynamicRow {
    /// First entry.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
}

/// A node of the map's tree.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BspNode {
    /// Plane: a point is in front where `xyz . p >= w`.
    pub plane: [f32; 4],
    /// Front and back child: a node, or `-1 - leaf`.
    pub children: [i32; 2],
}

/// Light lists of a view. Arrays of two or four are by kind of light (`LIGHT_*`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightView {
    /// [`LightBounds`] by kind: triangles, changing triangles, spheres, changing spheres.
    pub bounds: [u64; 4],
    /// [`TriangleLight`]s that stay as they are, and those of this frame.
    pub triangles: [u64; 2],
    /// [`SphereLight`]s of the map, and those of this frame.
    pub spheres: [u64; 2],
    /// [`SunLight`]s.
    pub suns: u64,
    /// `NORMAL_BINS` [`LightRow`]s of each cell (a piece of a cluster), one for each side of a cube that normals point to; the
    /// last is for points in no cell, and holds all lights.
    pub rows: u64,
    /// [`LightSlot`]s.
    pub slots: u64,
    /// [`DynamicRow`] of each cluster; the last is for points in none.
    pub dynamic_rows: u64,
    /// Numbers of the lights of this frame, row by row.
    pub dynamic_lights: u64,
    /// [`BspNode`]s.
    pub nodes: u64,
    /// Cell of each leaf (`i32`).
    pub leaf_cells: u64,
    /// Where the walk to a cell begins, for each box of a grid over the map (`i32`: a node, or `-1 - leaf`).
    pub grid: u64,
    /// Number of nodes; 0: every point lies in no cluster.
    pub node_count: u32,
    /// Number of rows.
    pub row_count: u32,
    /// Number of dynamic rows; 0 without such lights.
    pub dynamic_row_count: u32,
    /// Number of suns.
    pub sun_count: u32,
    /// `LIGHTS_*` bits.
    pub flags: u32,
    /// `SELECT_*`.
    pub selection: u32,
    /// Estimates a pixel.
    pub samples: u32,
    /// Candidates of resampled selection.
    pub candidates: u32,
    /// Scale of the map's lights.
    pub scale: f32,
    /// Least corner of that grid.
    pub grid_origin: Vec3,
    /// Boxes per unit of length.
    pub grid_scale: f32,
    /// Boxes along each axis; zero: no grid.
    pub grid_size: [u32; 3],
    /// Ambient light, as radiance of a white diffuse surface.
    pub ambient: Vec3,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
