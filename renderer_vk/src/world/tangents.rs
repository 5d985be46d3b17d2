//! Tangents and light directions of the map's vertices, for normal maps and highlights.

use bevy_mikktspace::{Geometry, TangentSpace};
use glam::{Vec2, Vec3};
use shaders::types::{MappedVertex, Vertex};

use super::WorldData;

/// Least cosine between a normal and the light grid's direction at which that direction is taken for baked light; below
/// it, the light comes along the normal. From `R_LightDirForPoint` of ioquake3's `opengl2`.
const LEAST_COSINE: f32 = 0.2;

impl WorldData {
    /// [`MappedVertex`] of each vertex.
    pub(super) fn mapped_vertices(&self) -> Vec<MappedVertex> {
        let mut mapped: Vec<MappedVertex> = (self.vertices.iter())
            .map(|vertex| MappedVertex {
                tangent: Vec3::ZERO,
                light: self.light_direction(vertex),
            })
            .collect();
        // each with its copy: those of curves for greater distances have the same vertices
        let drawn = self
            .surfaces
            .iter()
            .filter(|surface| surface.index_count > 0);
        let spans = drawn.flat_map(|surface| {
            let copy = surface.classic.map(|copy| copy.first_index);
            let firsts = [Some(surface.first_index), copy];
            firsts
                .into_iter()
                .flatten()
                .map(|first| (first, surface.index_count))
        });
        let triangles: Vec<[u32; 3]> = spans
            .filter_map(|(first, count)| {
                (self.indices.get(first as usize..)?).get(..count as usize)
            })
            .flat_map(|indices| indices.as_chunks::<3>().0)
            .copied()
            .collect();
        tangents(&self.vertices, &triangles, &mut mapped);
        mapped
    }

    fn light_direction(&self, vertex: &Vertex) -> Vec3 {
        let sample = (self.grid).and_then(|grid| grid.sample(&self.grid_points, vertex.position));
        let of_grid = sample.map(|sample| sample.direction);
        of_grid
            .filter(|direction| direction.dot(vertex.normal) > LEAST_COSINE)
            .unwrap_or(vertex.normal)
    }
}

/// MikkTSpace's tangents. A vertex has one tangent: where triangles of mirrored texture coordinates share it, that of the
/// first.
fn tangents(vertices: &[Vertex], triangles: &[[u32; 3]], mapped: &mut [MappedVertex]) {
    let mut mesh = Mesh {
        vertices,
        triangles,
        mapped,
    };
    // it has no errors
    let _ = bevy_mikktspace::generate_tangents(&mut mesh);
}

struct Mesh<'a> {
    vertices: &'a [Vertex],
    triangles: &'a [[u32; 3]],
    mapped: &'a mut [MappedVertex],
}

impl Mesh<'_> {
    /// Index of a vertex. The map's triangles are clockwise, MikkTSpace's counter-clockwise.
    fn index(&self, face: usize, corner: usize) -> Option<usize> {
        let triangle = self.triangles.get(face)?;
        Some(*triangle.get(2_usize.checked_sub(corner)?)? as usize)
    }

    fn vertex(&self, face: usize, corner: usize) -> Vertex {
        let index = self.index(face, corner);
        index
            .and_then(|index| self.vertices.get(index))
            .copied()
            .unwrap_or_default()
    }
}

/// Infinite and undefined values as 0.
fn finite(value: Vec3) -> [f32; 3] {
    if value.is_finite() {
        value.to_array()
    } else {
        [0.0; 3]
    }
}

impl Geometry for Mesh<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        finite(self.vertex(face, corner).position)
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        finite(self.vertex(face, corner).normal)
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let st = self.vertex(face, corner).st;
        // it grows upwards there
        let [s, t, _] = finite(Vec2::new(st.x, 1.0 - st.y).extend(0.0));
        [s, t]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let index = self.index(face, corner);
        let (Some(space), Some(found)) =
            (space, index.and_then(|index| self.mapped.get_mut(index)))
        else {
            return;
        };
        if found.tangent == Vec3::ZERO {
            found.tangent = Vec3::from_array(space.tangent()).normalize_or_zero();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(position: Vec3, normal: Vec3, st: Vec2) -> Vertex {
        Vertex {
            position,
            normal,
            st,
            ..Vertex::default()
        }
    }

    fn found(vertices: &[Vertex], triangles: &[[u32; 3]]) -> Vec<Vec3> {
        let mut mapped = vec![MappedVertex::default(); vertices.len()];
        tangents(vertices, triangles, &mut mapped);
        mapped.iter().map(|r| r.tangent).collect()
    }

    #[test]
    fn tangents_follow_s() {
        let st = |p: Vec2| Vec2::new(p.y, -p.x) * 0.25;
        let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(Vec2::from);
        let vertices = corners.map(|p| vertex(p.extend(0.0), Vec3::Z, st(p)));
        for tangent in found(&vertices, &[[0, 1, 2], [0, 2, 3]]) {
            assert!(tangent.abs_diff_eq(Vec3::Y, 1e-6), "{tangent}");
        }
    }

    /// A bent strip with smooth normals: the tangents at its middle are the mean of both halves', which a tangent for each
    /// triangle is not.
    #[test]
    fn tangents_are_smooth_over_an_edge() {
        let along = [
            Vec3::new(-1.0, 0.0, -1.0),
            Vec3::ZERO,
            Vec3::new(1.0, 0.0, -1.0),
        ];
        let normals = [Vec3::new(-1.0, 0.0, 1.0), Vec3::Z, Vec3::new(1.0, 0.0, 1.0)];
        let mut vertices = Vec::new();
        for (s, (at, normal)) in along.into_iter().zip(normals).enumerate() {
            for t in 0..2 {
                let st = Vec2::new(s as f32, -(t as f32));
                vertices.push(vertex(at + Vec3::Y * t as f32, normal.normalize(), st));
            }
        }
        let triangles = [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]];
        let tangents = found(&vertices, &triangles);
        for middle in [2, 3] {
            assert!(tangents[middle].abs_diff_eq(Vec3::X, 1e-5), "{tangents:?}");
        }
        let first = Vec3::new(1.0, 0.0, 1.0).normalize();
        assert!(tangents[0].abs_diff_eq(first, 1e-5), "{tangents:?}");
    }

    #[test]
    fn damaged_vertices_do_no_harm() {
        let st = [
            Vec2::splat(f32::NAN),
            Vec2::splat(f32::INFINITY),
            Vec2::ZERO,
        ];
        let at = [Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::splat(f32::MAX)];
        let vertices: Vec<_> = at
            .into_iter()
            .zip(st)
            .map(|(p, st)| vertex(p, p, st))
            .collect();
        let triangles = [[0, 1, 2], [0, 0, 0], [2, 1, 7]];
        assert!(found(&vertices, &triangles).iter().all(|t| !t.is_nan()));
        assert!(found(&[], &[]).is_empty());
    }
}
