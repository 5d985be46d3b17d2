//! Flat vertex and index arrays from the surfaces of a map.

use crate::overbright;
use glam::{Vec2, Vec3};
use q3bsp::{Bsp, DrawVert, PatchMesh, Plane, Surface, SurfaceKind};
use std::ops::Range;
use support::slice::{item, part, part_mut, span};

/// [`RelitWorld::triangle_lights`](crate::RelitWorld::triangle_lights) of a triangle that emits nothing.
pub const NO_LIGHT: u32 = u32::MAX;

/// A vertex as it is drawn. No component is NaN or infinite.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WorldVertex {
    /// Position in model space, id units.
    pub position: Vec3,
    /// Unit normal. Planar surfaces have their plane's, whatever the map stores, as in the engine.
    pub normal: Vec3,
    /// Texture coordinates; t = 0 is the first image row.
    pub st: Vec2,
    /// Coordinates in the lightmap page, 0..1.
    pub lightmap: Vec2,
    /// RGBA, RGB after the overbright shift, sRGB-encoded.
    pub color: [u8; 4],
}

/// A surface of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldSurface {
    /// What the map stores it as.
    pub kind: SurfaceKind,
    /// Index into [`RelitWorld::materials`](crate::RelitWorld::materials).
    pub material: u32,
    /// Fog that it is in: 1 + index into [`RelitWorld::fogs`](crate::RelitWorld::fogs), 0 for none. (The engine
    /// numbers fogs from 1 as well. An index without its fog gives 0.)
    pub fog: u32,
    /// Lightmap page, or a negative [`q3bsp::lightmap_index`]. Triangle soups are always lit by vertex, and so
    /// are surfaces with an index that no page has.
    pub lightmap: i32,
    /// Page of its main baked light ([`RelitWorld::page`](crate::RelitWorld::page)): an image that its script names, else as
    /// `lightmap`.
    pub light_page: i32,
    /// Brush model that it belongs to; 0 is the world.
    pub model: u32,
    /// First of its vertices.
    pub first_vertex: u32,
    /// Number of its vertices.
    pub num_vertices: u32,
    /// First of its indices: a multiple of 3.
    pub first_index: u32,
    /// Number of its indices: a multiple of 3, and 0 when it is not drawn.
    pub num_indices: u32,
    /// First of its lights in [`RelitWorld::lights`](crate::RelitWorld::lights).
    pub first_light: u32,
    /// Number of its lights.
    pub num_lights: u32,
    /// Smallest corner of its vertices' bounds, model space; zero when it is not drawn.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// Plane of a planar surface, normal to its front.
    pub plane: Option<Plane>,
}

impl WorldSurface {
    /// Its triangles, as places in [`RelitWorld::indices`](crate::RelitWorld::indices) divided by three.
    pub fn triangles(&self) -> Range<usize> {
        span(self.first_index / 3, self.num_indices / 3)
    }
}

/// A brush model: a range of surfaces, and where the map's entities put it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldModel {
    /// First surface.
    pub first_surface: u32,
    /// Number of surfaces.
    pub num_surfaces: u32,
    /// Where its entity stands at start: added to its vertices to get world space.
    pub origin: Vec3,
}

/// A corona at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flare {
    /// Position, id units.
    pub origin: Vec3,
    /// Colour as stored, nominally 0..1, display space.
    pub color: Vec3,
    /// Unit vector out of the surface that it marks, or zero.
    pub normal: Vec3,
    /// The map's surface.
    pub surface: u32,
    /// Index into [`RelitWorld::materials`](crate::RelitWorld::materials). The engine draws all flares with
    /// one material of its own.
    pub material: u32,
    /// As [`WorldSurface::fog`].
    pub fog: u32,
}

/// Vertices and triangles under construction.
#[derive(Default)]
pub(crate) struct Geometry {
    pub vertices: Vec<WorldVertex>,
    pub indices: Vec<u32>,
}

/// Range of a surface's geometry, and derived values.
pub(crate) struct Placed {
    pub first_vertex: u32,
    pub num_vertices: u32,
    pub first_index: u32,
    pub num_indices: u32,
    pub mins: Vec3,
    pub maxs: Vec3,
    pub plane: Option<Plane>,
}

impl Geometry {
    /// Appends surface `index` of the map. Surfaces that are not drawn append nothing.
    pub fn add(
        &mut self,
        bsp: &Bsp,
        surface: &Surface,
        patch: Option<&PatchMesh>,
        shift: u32,
    ) -> Placed {
        let first_vertex = self.vertices.len() as u32;
        let first_index = self.indices.len() as u32;
        let mut plane = None;
        match (surface.kind, patch) {
            (SurfaceKind::Patch, Some(patch)) => {
                let vertices: Vec<_> = patch.vertices.iter().map(DrawVert::finite).collect();
                self.append(&vertices, &patch.indices(), shift);
            }
            (SurfaceKind::Planar | SurfaceKind::TriangleSoup, _) => {
                let (vertices, corners) = polygon(bsp, surface);
                self.append(&vertices, &corners, shift);
                if surface.kind == SurfaceKind::Planar {
                    plane = self.flatten(first_vertex, first_index, stored_normal(surface));
                }
            }
            (SurfaceKind::Foliage, _) => {
                if let Some((vertices, corners)) = bsp.foliage_mesh(surface) {
                    let vertices: Vec<_> = vertices.iter().map(DrawVert::finite).collect();
                    self.append(&vertices, &corners, shift);
                }
            }
            _ => {}
        }
        self.repair_normals(first_vertex, first_index);
        let added = part(&self.vertices, first_vertex as usize..);
        let mut bounds = added.iter().map(|v| v.position);
        let first = bounds.next().unwrap_or(Vec3::ZERO);
        let (mins, maxs) = bounds.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
        Placed {
            first_vertex,
            num_vertices: added.len() as u32,
            first_index,
            num_indices: self.indices.len() as u32 - first_index,
            mins,
            maxs,
            plane,
        }
    }

    fn append(&mut self, vertices: &[DrawVert], corners: &[u32], shift: u32) {
        let base = self.vertices.len() as u32;
        self.vertices.extend(vertices.iter().map(|v| WorldVertex {
            position: v.position,
            normal: v.normal,
            st: v.st,
            lightmap: v.lightmap,
            color: overbright::shift_rgba(v.color, shift),
        }));
        let whole = corners.len() / 3 * 3;
        self.indices
            .extend(corners.iter().take(whole).map(|c| base + c));
    }

    /// Sets the plane of a planar surface. Many maps store a zero normal: then the triangles' winding decides, then
    /// the vertex normals. Compilers also merge bent faces into one "planar" surface, which keeps its vertex
    /// normals and has no plane.
    fn flatten(&mut self, first_vertex: u32, first_index: u32, stored: Vec3) -> Option<Plane> {
        let geometric = self.front(first_index);
        let vertices = self.vertices.get(first_vertex as usize..)?;
        let origin = vertices.first()?.position;
        let mean: Vec3 = vertices.iter().map(|v| v.normal).sum();
        let normal = [stored, geometric, mean]
            .into_iter()
            .map(Vec3::normalize_or_zero)
            .find(|n| *n != Vec3::ZERO)?;
        if self.bends(first_index, normal) {
            return None;
        }
        for vertex in self.vertices.get_mut(first_vertex as usize..)? {
            vertex.normal = normal;
        }
        Some(Plane {
            normal,
            dist: normal.dot(origin),
        })
    }

    /// Whether a triangle from `first_index` on, except slivers, deviates by more than about eight degrees from
    /// `normal`.
    fn bends(&self, first_index: u32, normal: Vec3) -> bool {
        let corners = part(&self.indices, first_index as usize..);
        corners.as_chunks::<3>().0.iter().any(|triangle| {
            let front = self.triangle_front(triangle);
            let area = front.length();
            // the normal of a sliver is rounding noise
            area > 1.0 && front.dot(normal) < 0.99 * area
        })
    }

    /// Area-weighted front normal of the triangles from `first_index` on.
    fn front(&self, first_index: u32) -> Vec3 {
        let corners = part(&self.indices, first_index as usize..);
        corners
            .as_chunks::<3>()
            .0
            .iter()
            .map(|c| self.triangle_front(c))
            .sum()
    }

    /// Twice a triangle's area times its front normal; front faces are clockwise.
    fn triangle_front(&self, corners: &[u32; 3]) -> Vec3 {
        let [a, b, c] = corners.map(|i| item(&self.vertices, i as usize).position);
        (c - a).cross(b - a)
    }

    /// Sets missing vertex normals to the mean normal of the adjacent triangles, else up.
    fn repair_normals(&mut self, first_vertex: u32, first_index: u32) {
        let first_vertex = first_vertex as usize;
        let broken = |v: &WorldVertex| v.normal.normalize_or_zero() == Vec3::ZERO;
        let added = part(&self.vertices, first_vertex..);
        if added.iter().any(broken) {
            let mut fronts = vec![Vec3::ZERO; added.len()];
            let corners = part(&self.indices, first_index as usize..);
            for corners in corners.as_chunks::<3>().0 {
                let front = self.triangle_front(corners);
                for &corner in corners {
                    if let Some(sum) = fronts.get_mut((corner as usize).wrapping_sub(first_vertex))
                    {
                        *sum += front;
                    }
                }
            }
            let added = part_mut(&mut self.vertices, first_vertex..);
            for (vertex, front) in added.iter_mut().zip(fronts) {
                if broken(vertex) {
                    vertex.normal = front.normalize_or(Vec3::Z);
                }
            }
        }
        for vertex in part_mut(&mut self.vertices, first_vertex..) {
            vertex.normal = vertex.normal.normalize_or(Vec3::Z);
        }
    }
}

/// A planar surface's stored normal, finite.
fn stored_normal(surface: &Surface) -> Vec3 {
    let stored = surface.lightmap_vecs[2];
    if stored.is_finite() {
        stored
    } else {
        Vec3::ZERO
    }
}

/// Vertices and triangle corners of a planar surface or a triangle soup.
fn polygon(bsp: &Bsp, surface: &Surface) -> (Vec<DrawVert>, Vec<u32>) {
    let vertices: Vec<_> = bsp
        .surface_vertices(surface)
        .iter()
        .map(DrawVert::finite)
        .collect();
    let corners = bsp.surface_triangles(surface).flatten().collect();
    (vertices, corners)
}
