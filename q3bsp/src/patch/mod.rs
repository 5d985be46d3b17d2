//! Patches: grids of bi-quadratic Bézier control points made into triangles as the engine does, so
//! that the same triangles meet the same neighbours without cracks.

mod normals;
mod stitch;
mod subdivide;

use crate::error::Error;
use crate::lumps::DrawVert;
use crate::surface::{Surface, SurfaceKind};
use crate::{Bsp, surface_flags};
use glam::Vec3;

/// Most rows and columns that subdivision and stitching make, as in the engine. Patches with more
/// control points keep them and are not subdivided.
pub const MAX_GRID_SIZE: usize = 65;

/// Most vertices that the subdivided patches of one map may have in all. A hostile file can ask for
/// 400 times its own size; shipped maps stay a hundred times below.
const MAX_TOTAL_VERTICES: usize = 4 << 20;

/// A tessellated patch. All numbers are finite.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PatchMesh {
    /// Number of columns, at least 2.
    pub width: usize,
    /// Number of rows, at least 2.
    pub height: usize,
    /// The vertices, row after row. Normals are unit vectors.
    pub vertices: Vec<DrawVert>,
    /// For each column the reciprocal of the distance, in id units, by which leaving it out would miss
    /// the curve; 0 for columns that are always drawn.
    pub column_errors: Vec<f32>,
    /// The same for rows.
    pub row_errors: Vec<f32>,
    /// Middle of the patch's LOD group: patches that share it choose their detail together.
    pub lod_origin: Vec3,
    /// Radius of the LOD group, id units.
    pub lod_radius: f32,
}

impl PatchMesh {
    /// Triangles over all rows and columns, clockwise seen from the front, three indices into
    /// [`Self::vertices`] each.
    pub fn indices(&self) -> Vec<u32> {
        self.indices_at(f32::INFINITY)
    }

    /// Triangles over the outer rows and columns and those inner ones whose error is at most
    /// `max_error`. The engine's value is `r_lodCurveError / max(1, |d| - lod_radius)` with `d` the
    /// distance of [`Self::lod_origin`] along the view axis.
    pub fn indices_at(&self, max_error: f32) -> Vec<u32> {
        let columns = used_lines(self.width, &self.column_errors, max_error);
        let rows = used_lines(self.height, &self.row_errors, max_error);
        let mut out = Vec::with_capacity(rows.len() * columns.len() * 6);
        for (&top, &bottom) in rows.iter().zip(rows.iter().skip(1)) {
            for (&left, &right) in columns.iter().zip(columns.iter().skip(1)) {
                let at = |row: usize, column: usize| {
                    u32::try_from(row * self.width + column).unwrap_or(u32::MAX)
                };
                out.extend([at(top, left), at(bottom, left), at(top, right)]);
                out.extend([at(top, right), at(bottom, left), at(bottom, right)]);
            }
        }
        out
    }
}

/// The first and last of `count` lines and those between whose error is at most `max_error`.
fn used_lines(count: usize, errors: &[f32], max_error: f32) -> Vec<usize> {
    (0..count)
        .filter(|&line| {
            line == 0
                || line + 1 == count
                || errors.get(line).is_none_or(|&error| error <= max_error)
        })
        .collect()
}

/// Tessellates `width` × `height` control points, width fastest. `subdivisions` is the largest distance,
/// id units, that a triangle edge may keep from the curve (`r_subdivisions`, by default 4). Numbers that
/// are not finite count as 0. The LOD group is not known here and stays zero.
///
/// # Errors
/// [`Error::Patch`] when a size is even or below 3, or the number of points is not their product.
pub fn tessellate_patch(
    points: &[DrawVert],
    width: usize,
    height: usize,
    subdivisions: f32,
) -> Result<PatchMesh, Error> {
    let reason = if width < 3 || height < 3 || width.is_multiple_of(2) || height.is_multiple_of(2) {
        Some("both sizes must be odd and at least 3")
    } else if width.checked_mul(height) != Some(points.len()) {
        Some("the number of points is not the product of the sizes")
    } else {
        None
    };
    if let Some(reason) = reason {
        return Err(Error::Patch {
            width,
            height,
            points: points.len(),
            reason,
        });
    }
    Ok(subdivide::tessellate(points, width, height, subdivisions))
}

impl Bsp {
    /// The mesh of one surface before stitching. `None` when it is no patch or when its shader
    /// reference has [`surface_flags::NODRAW`]: such patches are collision copies.
    pub fn patch_mesh(&self, surface: &Surface, subdivisions: f32) -> Option<PatchMesh> {
        let hidden = self.shader(surface.shader).surface_flags & surface_flags::NODRAW != 0;
        if surface.kind != SurfaceKind::Patch || hidden {
            return None;
        }
        let width = usize::try_from(surface.patch_width).ok()?;
        let height = usize::try_from(surface.patch_height).ok()?;
        let points = self.surface_vertices(surface);
        let mut mesh = tessellate_patch(points, width, height, subdivisions).ok()?;
        let [mins, maxs, _] = surface.lightmap_vecs;
        let origin = (mins + maxs) * 0.5;
        let radius = (origin - mins).length();
        if origin.is_finite() && radius.is_finite() {
            mesh.lod_origin = origin;
            mesh.lod_radius = radius;
        }
        Some(mesh)
    }

    /// The meshes of all patches, by surface index, stitched: where the edge of one patch has a point
    /// between two that its neighbour in the same LOD group shares, the neighbour gets it too, so that
    /// no crack shows. `None` for what is no patch and for hidden patches.
    ///
    /// A map whose patches would exceed some four million vertices in all (none shipped comes near) gets
    /// the rest of them without subdivision, which is logged.
    pub fn patch_meshes(&self, subdivisions: f32) -> Vec<Option<PatchMesh>> {
        let mut total = 0usize;
        let mut meshes: Vec<Option<PatchMesh>> = self
            .surfaces
            .iter()
            .map(|surface| {
                let exhausted = total > MAX_TOTAL_VERTICES;
                let subdivisions = if exhausted {
                    f32::INFINITY
                } else {
                    subdivisions
                };
                let mesh = self.patch_mesh(surface, subdivisions);
                total += mesh.as_ref().map_or(0, |mesh| mesh.vertices.len());
                mesh
            })
            .collect();
        if total > MAX_TOTAL_VERTICES {
            log::warn!("patches exceed {MAX_TOTAL_VERTICES} vertices; the last ones stay coarse");
        }
        stitch::stitch(&mut meshes);
        meshes
    }
}
