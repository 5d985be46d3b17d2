//! Lights, and the lists from which they are sampled.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A triangle that emits on the side where its corners are counter-clockwise.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TriangleLight {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Radiance, equal in all directions.
    pub radiance: Vec3,
    /// `LIGHT_*` bits.
    pub flags: u32,
    /// Unshadowed L below which it contributes nothing; 0: no cutoff.
    pub end: f32,
}

/// A small emitting sphere: a point light of the map or a dynamic light of the game; or a capsule, the mean of the
/// spheres along a line.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SphereLight {
    /// Centre.
    pub origin: Vec3,
    /// Radius, above 0.
    pub radius: f32,
    /// Radiance of its surface.
    pub radiance: Vec3,
    /// Surfaces nearer to the centre cast no shadow (the model that carries the light).
    pub clearance: f32,
    /// Direction of a spot, or of a line; of length 1.
    pub axis: Vec3,
    /// Cosine of the angle to `axis` up to which a spot has its full radiance; -1: no spot.
    pub cos_inner: f32,
    /// Cosine of the angle to `axis` from which on a spot is dark; -2: no spot.
    pub cos_outer: f32,
    /// Half the length of a line, units; 0: no line.
    pub half_length: f32,
    /// Radius of the ball of glowing gas that the sphere represents: at smaller distances the light is as at this
    /// radius. 0: none.
    pub core: f32,
    /// Distance at which linear falloff ends; 0: inverse-square falloff.
    pub reach: f32,
    /// Unshadowed L below which it contributes nothing; 0: no cutoff.
    pub end: f32,
}

/// A distant disc of light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SunLight {
    /// Unit vector towards its centre.
    pub direction: Vec3,
    /// Cosine of its angular radius.
    pub cos_angle: f32,
    /// Irradiance of a surface that faces it, divided by pi: L of a white diffuse surface.
    pub irradiance: Vec3,
}

/// A surface of the map as a light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EmittedLight {
    /// Radiance; zero for surfaces in no list.
    pub radiance: Vec3,
    /// 1: its triangles have `LIGHT_HITTABLE`.
    pub hittable: u32,
}

/// Bounds of a light for light sampling: a bounding sphere, and the emitted light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightBounds {
    /// Centre: of a triangle its centroid, so that it lies in the triangle's plane.
    pub centre: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Triangle: normal of the emitting side times area times luminance of the radiance. Sphere: direction of a spot
    /// times the cosine from which on it is dark, plus 2 so that the length is never zero; zero: no spot.
    pub axis: Vec3,
    /// Sphere: luminance of its radiant intensity, above 0. Triangle: 0, or -1 if both sides emit.
    pub omni_intensity: f32,
}

/// A slot of a row's alias table: two lights; a number in [0, 1) selects the slot's own light if it is below the
/// threshold, the light of the slot `alias` otherwise. Slots of a row are in ascending order of their own lights.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightSlot {
    /// The slot's own light: each light of a row has one slot.
    pub light: u32,
    /// Slot with the other light, from the row's first on.
    pub alias: u32,
    /// Probability that a draw from the row and its parent selects the slot's own light.
    pub chance: f32,
    /// Two fractions of 65,535: the threshold in the lower half; in the upper, above 0, the approximate part of the
    /// light that reaches the row's cell.
    pub fractions: u32,
}

/// Light list of a cell for one normal bin, or of a cluster: slots from `first` on. A row with a parent holds the
/// lights whose probability differs most from the parent's; one of `PARENT_DRAWS` draws is from the parent.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct LightRow {
    /// First slot.
    pub first: u32,
    /// Number of slots.
    pub count: u32,
    /// The row that holds all lights of this one, and has no parent; `NO_PARENT` if this row holds them.
    pub parent: u32,
    /// `LIGHT_ROW_*` bits.
    pub flags: u32,
    /// The cluster that contains the cell; no cluster if not below the number of clusters.
    pub cluster: u32,
}

/// A node of a tree over lights.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightTreeNode {
    /// Centre of the box around its lights.
    pub centre: Vec3,
    /// Radius of the sphere around the box.
    pub radius: f32,
    /// Middle of the cone of the normals of its lights.
    pub axis: Vec3,
    /// Cosine of the half angle of the cone; -1: all directions.
    pub cos_spread: f32,
    /// Sum of the luminances of the radiant intensities of its lights along their normals, over pi.
    pub power: f32,
    /// First of its two children, which are adjacent; 0: a leaf.
    pub first: u32,
    /// Number of a leaf's light.
    pub light: u32,
}

/// Light list of a cluster for lights of this frame: entries of `LightView::dynamic_lights`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct DynamicRow {
    /// First entry.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
}

/// A node of the map's BSP tree.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BspNode {
    /// Plane: a point is in front where `xyz . p >= w`.
    pub plane: [f32; 4],
    /// Front and back child: a node, or `-1 - leaf`.
    pub children: [i32; 2],
}

/// Light samples that one frame leaves to the next.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ReservoirView {
    /// Two texels of 16 bytes a pixel (`reservoirs.glsl`); 0: none are kept.
    pub history: u64,
    /// `RESERVOIRS_*` bits.
    pub flags: u32,
    /// Number of changing triangle lights that keep their numbers: they are the first.
    pub lasting_triangles: u32,
    /// The same of changing sphere lights.
    pub lasting_spheres: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Light lists of a view. Arrays of two or four are indexed by kind of light (`LIGHT_*`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightView {
    /// [`LightBounds`] by kind: triangles, changing triangles, spheres, changing spheres.
    pub bounds: [u64; 4],
    /// [`TriangleLight`]s with constant radiance, and those of this frame.
    pub triangles: [u64; 2],
    /// [`SphereLight`]s of the map, and those of this frame.
    pub spheres: [u64; 2],
    /// [`SunLight`]s.
    pub suns: u64,
    /// `NORMAL_BINS` [`LightRow`]s of each cell (a piece of a cluster), one for each normal bin; then one for points in
    /// no cell, which holds all lights; then those of the clusters.
    pub rows: u64,
    /// [`LightSlot`]s.
    pub slots: u64,
    /// [`DynamicRow`] of each cluster; the last is for points in no cluster.
    pub dynamic_rows: u64,
    /// Numbers of the lights of this frame, row by row.
    pub dynamic_lights: u64,
    /// [`BspNode`]s.
    pub nodes: u64,
    /// Cell of each leaf (`i32`).
    pub leaf_cells: u64,
    /// [`EmittedLight`] of each surface of the map.
    pub emitted: u64,
    /// Start of the BSP walk for each box of a grid over the map (`i32`: a node, or `-1 - leaf`).
    pub grid: u64,
    /// [`LightTreeNode`]s over the map's constant lights, root first; 0: the lists are used.
    pub tree: u64,
    /// The same over lights that move or change, in their present state.
    pub changing_tree: u64,
    /// Mean light of each cell by the map's light grid, as radiance of a white diffuse surface (`Vec3`), and after it
    /// their mean.
    pub cell_light: u64,
    /// Number of nodes; 0: every point lies in no cluster.
    pub node_count: u32,
    /// Number of cells.
    pub cell_count: u32,
    /// Number of dynamic rows; 0: no lights of this frame.
    pub dynamic_row_count: u32,
    /// Number of suns.
    pub sun_count: u32,
    /// `LIGHTS_*` bits.
    pub flags: u32,
    /// `SELECT_*`.
    pub selection: u32,
    /// Estimates per pixel.
    pub samples: u32,
    /// Candidates of resampled importance sampling.
    pub candidates: u32,
    /// Factor of the map's lights (`rt_lightScale`).
    pub scale: f32,
    /// Least corner of `grid`.
    pub grid_origin: Vec3,
    /// Boxes per unit of length.
    pub grid_scale: f32,
    /// Boxes along each axis; zero: no grid.
    pub grid_size: [u32; 3],
    /// Ambient light, as radiance of a white diffuse surface.
    pub ambient: Vec3,
    /// Number of surfaces in `emitted`.
    pub emitted_count: u32,
    /// Number of nodes of `tree`.
    pub tree_nodes: u32,
    /// Number of nodes of `changing_tree`.
    pub changing_tree_nodes: u32,
}
