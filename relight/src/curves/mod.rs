//! The curves of a map as surfaces that rays hit: exact biquadratic Bézier pieces, and the triangles of their tessellation
//! in the same hierarchy, for comparison.

mod bezier;
mod compare;
#[cfg(test)]
mod tests;
mod tree;

use glam::Vec3;
use q3bsp::{Bsp, PatchMesh, SurfaceKind, surface_flags};

pub use bezier::Piece;
pub use compare::{CurveErrors, errors_along_normals, rays_around};
pub use tree::{CurveRay, Shape, SurfaceHit, Tree};

/// A triangle with the normals of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Corners, clockwise seen from the front.
    pub corners: [Vec3; 3],
    /// Unit normals there.
    pub normals: [Vec3; 3],
}

/// The exact pieces of a map's drawn patches.
pub fn pieces(bsp: &Bsp) -> Vec<Piece> {
    let drawn = bsp.surfaces.iter().filter(|surface| {
        let hidden = bsp.shader(surface.shader).surface_flags & surface_flags::NODRAW != 0;
        surface.kind == SurfaceKind::Patch && !hidden
    });
    let mut pieces = Vec::new();
    for surface in drawn {
        let (Ok(width), Ok(height)) = (
            usize::try_from(surface.patch_width),
            usize::try_from(surface.patch_height),
        ) else {
            continue;
        };
        let points = bsp.surface_vertices(surface);
        if width < 3 || height < 3 || points.len() != width.saturating_mul(height) {
            continue;
        }
        let at = |row: usize, column: usize| {
            let point = points.get(row * width + column);
            point.map_or(Vec3::ZERO, |p| p.finite().position)
        };
        for row in (0..height - 2).step_by(2) {
            for column in (0..width - 2).step_by(2) {
                let points = [0, 1, 2].map(|j| [0, 1, 2].map(|i| at(row + j, column + i)));
                pieces.push(Piece { points });
            }
        }
    }
    pieces
}

/// The triangles of a map's drawn patches at a value of `r_subdivisions`.
pub fn facets(bsp: &Bsp, subdivisions: f32) -> Vec<Facet> {
    let meshes = bsp.patch_meshes(subdivisions);
    meshes.iter().flatten().flat_map(facets_of).collect()
}

fn facets_of(mesh: &PatchMesh) -> Vec<Facet> {
    let vertex = |i: u32| mesh.vertices.get(i as usize).copied();
    let indices = mesh.indices();
    let (triangles, _) = indices.as_chunks::<3>();
    let facet = |&[a, b, c]: &[u32; 3]| {
        let corners = [vertex(a)?, vertex(b)?, vertex(c)?];
        Some(Facet {
            corners: corners.map(|v| v.position),
            normals: corners.map(|v| v.normal),
        })
    };
    triangles.iter().filter_map(facet).collect()
}
