//! Light at vertices of the map's triangles, which bounces take where they hit the map.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The vertices on a triangle: a grid of `segments` equal parts of each edge, row by row from the first corner.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightGrid {
    /// The first vertex.
    pub first: u32,
    /// Segments of an edge, and `GRID_TWO_SIDED`; 0: the triangle has no vertices.
    pub segments: u32,
}

/// Sums over the samples of a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VertexSum {
    /// Light of the map's lamps.
    pub direct: Vec3,
    /// Samples in `direct`.
    pub samples: f32,
    /// Light of surfaces.
    pub bounced: Vec3,
    /// Samples in `bounced`.
    pub bounce_samples: f32,
    /// Samples whose ray has met the back of a surface: the point lies inside of a body.
    pub inside: f32,
    /// `CELL_*` bits.
    pub cells: u32,
}

/// Parameters of the light at vertices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VertexLightView {
    /// The map's [`Triangle`](crate::types::Triangle)s; those of the world come first.
    pub triangles: u64,
    /// Their vertices.
    pub vertices: u64,
    /// A [`LightGrid`] for each of the first triangles.
    pub grids: u64,
    /// Light of each vertex, packed (`pack_vertex_light`).
    pub light: u64,
    /// The triangle of each vertex; while the light is computed only, as `sums` and `used`.
    pub owners: u64,
    /// A [`VertexSum`] for each vertex.
    pub sums: u64,
    /// Number of vertices in use, which may exceed `capacity`.
    pub used: u64,
    /// Number of the first triangles that stop rays.
    pub grid_count: u32,
    /// Number of the first triangles that belong to the world.
    pub world_count: u32,
    /// Most vertices.
    pub capacity: u32,
    /// Samples of a vertex in each sweep.
    pub samples: u32,
    /// 1: lights of the map's lists move or change.
    pub changing: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
