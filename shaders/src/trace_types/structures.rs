//! What rays find: geometries, and the hierarchies of the compute tracer.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// One geometry of the acceleration structures: found by a hit's instance custom index plus geometry index.
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

/// A node of a bounding volume hierarchy: the boxes of up to four children, in steps of a grid of its own (after Ylitie,
/// Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Corner of the grid.
    pub origin: Vec3,
    /// Size of a step along each axis, above 0.
    pub step: Vec3,
    /// Of each axis the low sides of the children's boxes, one byte for each child, the first in the lowest byte.
    pub low: [u32; 3],
    /// The high sides.
    pub high: [u32; 3],
    /// Index of the child's node, or `BVH_LEAF` with the number of its entries less one and the first of them, or
    /// `BVH_NONE`.
    pub children: [u32; 4],
}

/// A triangle in the order of a hierarchy's leafs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhTriangle {
    /// First corner.
    pub a: Vec3,
    /// Second corner.
    pub b: Vec3,
    /// Third corner.
    pub c: Vec3,
    /// Index of the geometry's triangle.
    pub primitive: u32,
    /// Number of the geometry, counted from the instance's first.
    pub part: u32,
    /// Makes the size a multiple of 16, so that it is read in three pieces.
    pub padding: u32,
}

/// A placed hierarchy, in the order of the top hierarchy's leafs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhInstance {
    /// Its [`BvhNode`]s.
    pub nodes: u64,
    /// Its [`BvhTriangle`]s.
    pub triangles: u64,
    /// World to object, three rows.
    pub to_object: [[f32; 4]; 3],
    /// Index of its first geometry record.
    pub geometry: u32,
    /// Rays see it when their mask shares a bit.
    pub mask: u32,
}
