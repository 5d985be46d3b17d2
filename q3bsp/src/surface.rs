//! Lump 13: the records of what is drawn.

use crate::bytes::{Fields, Put, Record};
use crate::ids::ShaderId;
use glam::Vec3;

/// What a [`Surface`] is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum SurfaceKind {
    /// A flat polygon with its triangles; stored 1.
    Planar,
    /// A grid of control points of bi-quadratic Bézier patches; stored 2.
    Patch,
    /// Any triangles, vertex lit; stored 3.
    #[cfg_attr(feature = "serde", serde(rename = "mesh"))]
    TriangleSoup,
    /// A point that shows a corona, without geometry; stored 4.
    Flare,
    /// A mesh that stands in many places (`IBSP` 47, Enemy Territory); stored 5. `patch_height` vertices are the mesh,
    /// the `patch_width` that follow are its places. See [`crate::Bsp::foliage_mesh`].
    Foliage,
    /// Unknown to the engine. Never in a validated map.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Other(i32),
}

impl SurfaceKind {
    /// From the stored number.
    pub fn from_raw(raw: i32) -> SurfaceKind {
        match raw {
            1 => SurfaceKind::Planar,
            2 => SurfaceKind::Patch,
            3 => SurfaceKind::TriangleSoup,
            4 => SurfaceKind::Flare,
            5 => SurfaceKind::Foliage,
            other => SurfaceKind::Other(other),
        }
    }

    /// The stored number.
    pub fn raw(self) -> i32 {
        match self {
            SurfaceKind::Planar => 1,
            SurfaceKind::Patch => 2,
            SurfaceKind::TriangleSoup => 3,
            SurfaceKind::Flare => 4,
            SurfaceKind::Foliage => 5,
            SurfaceKind::Other(raw) => raw,
        }
    }
}

/// Negative values of [`Surface::lightmap`].
pub mod lightmap_index {
    /// No lightmap: lit like an entity.
    pub const NONE: i32 = -1;
    /// White: full bright.
    pub const WHITE: i32 = -2;
    /// Lit by vertex colours.
    pub const BY_VERTEX: i32 = -3;
    /// 2D drawing; never from a compiler.
    pub const TWO_D: i32 = -4;
}

/// Lump 13: something drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surface {
    /// Shader.
    pub shader: ShaderId,
    /// Fog index, or -1.
    pub fog: i32,
    /// What the surface is made of.
    pub kind: SurfaceKind,
    /// First vertex or control point.
    pub first_vert: i32,
    /// Number of them; width × height for a patch.
    pub num_verts: i32,
    /// First entry in [`crate::Bsp::indices`].
    pub first_index: i32,
    /// Number of them: a multiple of three, 0 for patches drawn by their grid.
    pub num_indices: i32,
    /// Lightmap page, or one of [`lightmap_index`].
    pub lightmap: i32,
    /// Left column of the chart in its page, texels. Not used for drawing.
    pub lightmap_x: i32,
    /// Upper row of the chart.
    pub lightmap_y: i32,
    /// Width of the chart.
    pub lightmap_width: i32,
    /// Height of the chart.
    pub lightmap_height: i32,
    /// World position of the chart's first texel; of a flare: its position.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub lightmap_origin: Vec3,
    /// World steps per texel and the plane normal (often zero); of a patch: mins and maxs of its LOD
    /// group; of a flare: colour, unused, normal.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub lightmap_vecs: [Vec3; 3],
    /// Control points per row: odd and at least 3 for a patch. Of foliage: places.
    pub patch_width: i32,
    /// Rows of control points: odd and at least 3 for a patch. Of foliage: vertices of the mesh.
    pub patch_height: i32,
}

impl Record for Surface {
    const STRIDE: usize = 104;
    fn decode(mut f: Fields<'_>) -> Self {
        Surface {
            shader: ShaderId(f.i32()),
            fog: f.i32(),
            kind: SurfaceKind::from_raw(f.i32()),
            first_vert: f.i32(),
            num_verts: f.i32(),
            first_index: f.i32(),
            num_indices: f.i32(),
            lightmap: f.i32(),
            lightmap_x: f.i32(),
            lightmap_y: f.i32(),
            lightmap_width: f.i32(),
            lightmap_height: f.i32(),
            lightmap_origin: f.vec3(),
            lightmap_vecs: [f.vec3(), f.vec3(), f.vec3()],
            patch_width: f.i32(),
            patch_height: f.i32(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        for v in [
            self.shader.0,
            self.fog,
            self.kind.raw(),
            self.first_vert,
            self.num_verts,
            self.first_index,
            self.num_indices,
            self.lightmap,
            self.lightmap_x,
            self.lightmap_y,
            self.lightmap_width,
            self.lightmap_height,
        ] {
            out.put_i32(v);
        }
        out.put_vec3(self.lightmap_origin);
        for v in self.lightmap_vecs {
            out.put_vec3(v);
        }
        out.put_i32(self.patch_width);
        out.put_i32(self.patch_height);
    }
}
