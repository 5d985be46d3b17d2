//! Shadow volumes of models (`cg_shadows 2`): the silhouette of a mesh from its light, extruded away from the light.
//!
//! Source: engine behaviour of `renderer_opengl1` (stencil shadows). A pixel is in shadow if its view ray enters
//! volumes more often than it leaves them. The volumes have no caps; they end far below any visible floor.

use glam::Vec3;
use shaders::types::{Instance, Vertex};

use super::entity::to_world;

/// Length of the extrusion, model units.
const REACH: f32 = 512.0;

/// The shadow volumes of a view, world space.
#[derive(Clone, Debug, Default)]
pub struct ShadowVolumes {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Indices, three a triangle. Front faces wind counter-clockwise on the screen, in a mirror clockwise.
    pub indices: Vec<u32>,
    /// First index and number of indices for each entity: its stencil increments precede its decrements.
    pub ranges: Vec<(u32, u32)>,
    /// Instance of the last range.
    newest: Option<u32>,
    /// Buffer: edges of the triangles that face away from the light.
    edges: Vec<(u32, u32)>,
}

impl ShadowVolumes {
    /// Empties the lists.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.indices.clear();
        self.ranges.clear();
        self.newest = None;
    }

    /// Adds the volumes of a surface of instance `number`. `base`: number of the first of `vertices` in `indices`.
    pub(super) fn add(
        &mut self,
        number: u32,
        instance: &Instance,
        vertices: &[Vertex],
        indices: &[u32],
        base: u32,
    ) {
        let light = instance.light_direction;
        let start = self.indices.len();
        let at = |index: u32| {
            // A caller may add an index that is none; its triangle casts no shadow.
            let vertex = vertices.get(index.wrapping_sub(base) as usize);
            vertex.map(|vertex| vertex.position)
        };
        self.edges.clear();
        for &[a, b, c] in indices.as_chunks::<3>().0 {
            let (Some(pa), Some(pb), Some(pc)) = (at(a), at(b), at(c)) else {
                continue;
            };
            // triangles wind clockwise, so this normal points inwards
            if (pb - pa).cross(pc - pa).dot(light) > 0.0 {
                self.edges.extend([(a, b), (b, c), (c, a)]);
            }
        }
        self.edges.sort_unstable();
        for &(a, b) in &self.edges {
            // an edge between two such triangles is no silhouette
            if self.edges.binary_search(&(b, a)).is_ok() {
                continue;
            }
            let (Some(pa), Some(pb)) = (at(a), at(b)) else {
                continue;
            };
            let Ok(first) = u32::try_from(self.positions.len()) else {
                return; // indices have 32 bits
            };
            let away = light * REACH;
            self.positions
                .extend([pa, pa - away, pb, pb - away].map(|p| to_world(instance, p)));
            let quad = [0, 1, 2, 2, 1, 3];
            self.indices.extend(quad.map(|corner| first + corner));
        }
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let count = size(self.indices.len() - start);
        if count == 0 {
            return;
        }
        match self.ranges.last_mut() {
            Some(last) if self.newest == Some(number) => last.1 += count,
            _ => self.ranges.push((size(start), count)),
        }
        self.newest = Some(number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::vertex;

    /// A unit cube: bits 0 to 2 of a corner's number are its coordinates; faces wind clockwise seen from outside.
    fn cube() -> (Vec<Vertex>, Vec<u32>) {
        let vertices = (0..8u8)
            .map(|i| {
                let bit = |n: u8| f32::from(i >> n & 1);
                vertex(bit(0), bit(1), bit(2))
            })
            .collect();
        let triangles = testkit::cube_triangles();
        (vertices, triangles.flatten().map(|i| 10 + i).collect())
    }

    fn lit_from(light: Vec3) -> Instance {
        Instance {
            axis: [Vec3::X, Vec3::Y, Vec3::Z],
            origin: Vec3::new(100.0, 0.0, 0.0),
            light_direction: light,
            ..Instance::default()
        }
    }

    #[test]
    fn a_cube_has_the_outline_that_its_light_sees() {
        let (vertices, indices) = cube();
        let mut volumes = ShadowVolumes::default();
        volumes.add(1, &lit_from(Vec3::Z), &vertices, &indices, 10);
        // four edges of the lower side, a quad each
        assert_eq!(volumes.ranges, [(0, 24)]);
        assert_eq!(volumes.positions.len(), 16);
        let depths: Vec<f32> = volumes.positions.iter().map(|p| p.z).collect();
        assert!(depths.iter().all(|z| *z == 0.0 || *z == -REACH));
        // every side faces outwards with counter-clockwise winding
        let middle = Vec3::new(100.5, 0.5, -REACH * 0.5);
        for &[a, b, c] in volumes.indices.as_chunks::<3>().0 {
            let [a, b, c] = [a, b, c].map(|i| volumes.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(a - middle) > 0.0);
        }
        // another surface of the same entity extends its range, another entity begins one
        volumes.add(1, &lit_from(Vec3::Z), &vertices, &indices, 10);
        volumes.add(2, &lit_from(Vec3::Z), &vertices, &indices, 10);
        assert_eq!(volumes.ranges, [(0, 48), (48, 24)]);
        // from a corner, the silhouette has six edges
        volumes.clear();
        volumes.add(1, &lit_from(Vec3::ONE.normalize()), &vertices, &indices, 10);
        assert_eq!(volumes.positions.len(), 24);
    }

    #[test]
    fn without_direction_there_is_no_shadow() {
        let (vertices, indices) = cube();
        let mut volumes = ShadowVolumes::default();
        volumes.add(1, &lit_from(Vec3::ZERO), &vertices, &indices, 10);
        // indices out of range
        volumes.add(1, &lit_from(Vec3::Z), &vertices, &[0, 1, 99], 10);
        assert!(volumes.ranges.is_empty());
    }
}
