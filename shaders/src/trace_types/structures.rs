//! Geometry that rays hit, and the hierarchies of the compute tracer.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// One geometry of the acceleration structures; its index is a hit's instance custom index plus geometry index.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct GeometryRecord {
    /// [`crate::types::Triangle`]s, one for each primitive.
    pub triangles: u64,
    /// [`crate::types::Vertex`]es that the triangles index, in the space of the instance.
    pub vertices: u64,
    /// Instance of all its triangles, or `NO_INSTANCE`: each triangle names its own.
    pub instance: u32,
    /// `KIND_*`.
    pub kind: u32,
}

/// Push constants of a filter step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct FilterStep {
    /// The `TraceView`.
    pub view: u64,
    /// Input: address of texels, or bindless index of an image.
    pub source: u64,
    /// Output, likewise.
    pub target: u64,
    /// Distance of the taps, pixels.
    pub spacing: u32,
    /// Makes the size a multiple of 8 bytes.
    pub padding: u32,
}

/// Push constants of the pass that moves records of instances (`instance_list.comp`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct ListStep {
    /// Records to be read.
    pub source: u64,
    /// 32-bit place of each entry.
    pub places: u64,
    /// Records to be written.
    pub target: u64,
    /// 32-bit words of a record.
    pub words: u32,
    /// Number of entries.
    pub count: u32,
    /// 1: entry after entry is read, and written to its place; 0: read from its place, and written entry after entry.
    pub to_places: u32,
    /// Makes the size a multiple of 8 bytes.
    pub padding: u32,
}

/// Push constants of a pass other than a filter step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct PassStep {
    /// The `TraceView`.
    pub view: u64,
    /// Number of the run, of a pass with several: of the bounce, or 1 for the other side of split paths.
    pub number: u32,
    /// Pixel of each cell of 2 × 2, where they take turns; from bit 2 on, the number of the pixel's path.
    pub part: u32,
}

/// Push constants of the draws of first hits, and of the pass that reads them (`rt_firstHits`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FirstHitsStep {
    /// The `TraceView`.
    pub view: u64,
    /// Address of the map's vertices; geometry that has them is drawn at `positions`.
    pub map_vertices: u64,
    /// Positions of the map's vertices in its acceleration structures.
    pub positions: u64,
    /// A place relative to the eye, times the first two, is a place of the picture from -1 to 1 times the depth, which is
    /// the product with the third.
    pub to_picture: [Vec3; 3],
    /// Bindless index of the image of geometries and triangles.
    pub image: u32,
    /// 1: the draws are of first-person geometry.
    pub first_person: u32,
    /// Makes the size a multiple of 8 bytes.
    pub padding: u32,
}

/// Push constants of a pass of the hybrid look.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct HybridStep {
    /// The `TraceView`.
    pub view: u64,
    /// The same with the models alone in its top level.
    pub models: u64,
    /// The [`HybridView`](crate::types::HybridView).
    pub hybrid: u64,
    /// Number of the filter's step.
    pub number: u32,
    /// Makes the size a multiple of 8 bytes.
    pub padding: u32,
}

/// A node of a bounding volume hierarchy: boxes of up to four children, quantized to a grid of the node (after Ylitie,
/// Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Least corner of the grid.
    pub origin: Vec3,
    /// Size of a step along each axis, above 0.
    pub step: Vec3,
    /// Low sides of the children's boxes along each axis, one byte for each child, the first in the lowest byte.
    pub low: [u32; 3],
    /// High sides, likewise.
    pub high: [u32; 3],
    /// Index of the child's node; or `BVH_LEAF` with the number of entries minus one and the first entry; or
    /// `BVH_NONE`.
    pub children: [u32; 4],
}

/// A triangle in the order of a hierarchy's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhTriangle {
    /// First corner.
    pub a: Vec3,
    /// Second corner.
    pub b: Vec3,
    /// Third corner.
    pub c: Vec3,
    /// Index of the triangle in its geometry.
    pub primitive: u32,
    /// Index of the geometry, counted from the instance's first.
    pub part: u32,
    /// Makes the size a multiple of 16, for three reads of 16 bytes.
    pub padding: u32,
}

/// A uniform grid of cubic cells over the triangles of an instance.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GridRecord {
    /// For each cell (x changes fastest, z slowest) the place of its first entry, `u32`; at the end the number of
    /// entries.
    pub starts: u64,
    /// Indices of [`BvhTriangle`]s, cell by cell, `u32`.
    pub entries: u64,
    /// Least corner of the first cell, in the space of the instance.
    pub origin: Vec3,
    /// Edge of a cell.
    pub edge: f32,
    /// Cells along each axis, at least 1.
    pub counts: [u32; 3],
    /// Makes the size a multiple of 8 bytes.
    pub padding: u32,
}

/// An instance of a hierarchy, in the order of the top hierarchy's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhInstance {
    /// Its [`BvhNode`]s; with `INSTANCE_GRID` in `mask`, its [`GridRecord`].
    pub nodes: u64,
    /// Its [`BvhTriangle`]s.
    pub triangles: u64,
    /// World to object, three rows.
    pub to_object: [[f32; 4]; 3],
    /// Index of its first geometry record.
    pub geometry: u32,
    /// A ray tests the instance if their masks share a bit; and `INSTANCE_GRID`.
    pub mask: u32,
}
