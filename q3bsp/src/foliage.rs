//! Foliage of Enemy Territory: a mesh stored once, and the places it stands in.

use crate::Bsp;
use crate::lumps::DrawVert;
use crate::surface::{Surface, SurfaceKind};
use glam::Vec3;

/// Most vertices, and most corners, that the foliage of one surface is spread out to. Shipped maps stay far below; a hostile file could
/// ask for the square of its size.
const MAX_VERTICES: usize = 1 << 22;

impl Bsp {
    /// The triangles of a foliage surface, its mesh repeated at every place in the place's colour: vertices, and
    /// corners as indices into them, three per triangle. `None` for surfaces of other kinds. Places beyond four million
    /// vertices or corners are left out.
    pub fn foliage_mesh(&self, surface: &Surface) -> Option<(Vec<DrawVert>, Vec<u32>)> {
        if surface.kind != SurfaceKind::Foliage {
            return None;
        }
        let stored = self.surface_vertices(surface);
        let mesh = usize::try_from(surface.patch_height).ok()?;
        let places = usize::try_from(surface.patch_width).ok()?;
        let (mesh, rest) = stored.split_at_checked(mesh)?;
        let triangles = self.surface_triangles(surface);
        let corners = self.surface_indices(surface).len();
        let most = MAX_VERTICES / mesh.len().max(corners).max(1);
        let mut vertices = Vec::new();
        let mut indices = Vec::new();
        for place in rest.iter().take(places.min(most)) {
            let base = u32::try_from(vertices.len()).ok()?;
            let offset = place.position;
            vertices.extend(mesh.iter().map(|v| DrawVert {
                position: v.position + offset,
                color: place.color,
                ..*v
            }));
            indices.extend(triangles.clone().flatten().map(|corner| base + corner));
        }
        let clean = |v: f32| if v.is_finite() { v } else { 0.0 };
        for vertex in &mut vertices {
            vertex.position = Vec3::map(vertex.position, clean);
        }
        Some((vertices, indices))
    }
}
