//! The sky of the classic look: a box around the camera, cloud layers projected from a sphere onto it, and the sun.
//!
//! Source: engine behaviour of `renderer_opengl1`: faces and their texture axes, a dome over a planet of radius 4096
//! for the clouds, depth at the far end.

use glam::{Vec2, Vec3};
use shaders::types::Vertex;
use shaderscript::Sky;

use crate::scene::{Cells, SKY_CELLS, SUN_SIZE, View, perpendicular};

/// Radius of the planet below the clouds, units.
const PLANET_RADIUS: f32 = 4096.0;

/// Coordinates of the cloud layer in a direction (of any length); `height` of the clouds above the ground.
pub fn cloud_coordinates(direction: Vec3, height: f32) -> Vec2 {
    let r = PLANET_RADIUS;
    let d2 = direction.length_squared();
    let root = direction.z * direction.z * r * r + d2 * (2.0 * r * height + height * height);
    let p = (-direction.z * r + root.max(0.0).sqrt()) / d2;
    let v = (direction * p + Vec3::new(0.0, 0.0, r)).normalize();
    Vec2::new(v.x.clamp(-1.0, 1.0).acos(), v.y.clamp(-1.0, 1.0).acos())
}

/// Texture coordinates of a face.
#[derive(Clone, Copy, Debug)]
pub enum Coordinates {
    /// Of the box's image.
    Box,
    /// Of the cloud layer at this height, units.
    Clouds(f32),
}

/// Vertices and indices to append to.
pub struct Mesh<'a> {
    /// All vertices.
    pub vertices: &'a mut Vec<Vertex>,
    /// All indices.
    pub indices: &'a mut Vec<u32>,
}

impl Mesh<'_> {
    /// Appends the given cells of a face of the box around the camera, and returns their range of indices.
    pub fn append_face(
        &mut self,
        face: usize,
        cells: Cells,
        view: &View,
        color: u32,
        coordinates: Coordinates,
    ) -> (u32, u32) {
        let first_vertex = self.vertices.len() as u32;
        let first_index = self.indices.len() as u32;
        for row in cells.from[1]..=cells.to[1] {
            for column in cells.from[0]..=cells.to[0] {
                let s = column as f32 / SKY_CELLS as f32 * 2.0 - 1.0;
                let t = row as f32 / SKY_CELLS as f32 * 2.0 - 1.0;
                let point = Sky::side_point(face, s, t);
                let st = match coordinates {
                    Coordinates::Box => Vec2::new((s + 1.0) * 0.5, 1.0 - (t + 1.0) * 0.5),
                    Coordinates::Clouds(height) => cloud_coordinates(point, height),
                };
                self.vertices.push(Vertex {
                    position: view.origin + point * view.sky_distance(),
                    normal: -point.normalize(),
                    st,
                    lightmap: Vec2::ZERO,
                    color,
                });
            }
        }
        let (columns, rows) = (cells.to[0] - cells.from[0], cells.to[1] - cells.from[1]);
        let width = columns as u32 + 1;
        for row in 0..rows as u32 {
            for column in 0..columns as u32 {
                let a = first_vertex + row * width + column;
                self.indices
                    .extend([a, a + width, a + 1, a + 1, a + width, a + width + 1]);
            }
        }
        (first_index, self.indices.len() as u32 - first_index)
    }

    /// Appends the quad of a sun in `direction` (unit length), and returns its range of indices.
    pub fn append_sun(&mut self, direction: Vec3, view: &View) -> (u32, u32) {
        let first_vertex = self.vertices.len() as u32;
        let first_index = self.indices.len() as u32;
        let distance = view.sky_distance();
        let middle = view.origin + direction * distance;
        let left = perpendicular(direction) * distance * SUN_SIZE;
        let up = direction.cross(left);
        let corners = [left + up, up - left, -left - up, left - up];
        let coordinates = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        for (corner, st) in corners.into_iter().zip(coordinates) {
            self.vertices.push(Vertex {
                position: middle + corner,
                normal: -view.axis[0],
                st,
                lightmap: Vec2::ZERO,
                color: u32::MAX,
            });
        }
        self.indices
            .extend([0, 1, 3, 3, 1, 2].map(|i| first_vertex + i));
        (first_index, 6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::RefDef;

    #[test]
    fn clouds_overhead_are_at_a_quarter_turn() {
        // straight up, the unit vector to the layer is (0, 0, 1), whose x and y are 0: acos 0
        let uv = cloud_coordinates(Vec3::Z, 512.0);
        assert!((uv - Vec2::splat(std::f32::consts::FRAC_PI_2)).length() < 1e-6);
        // towards +x, the layer is sqrt(2 R h + h^2) units away
        let uv = cloud_coordinates(Vec3::X, 512.0);
        let reach = (2.0_f32 * 4096.0 * 512.0 + 512.0 * 512.0).sqrt();
        let expected = (reach / (4096.0 + 512.0)).acos();
        assert!((uv.x - expected).abs() < 1e-5, "{uv} {expected}");
    }

    #[test]
    fn faces_have_the_cells_asked_for() {
        let view = View::new(&RefDef::default(), 4.0, 1750.0);
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        let mut mesh = Mesh {
            vertices: &mut vertices,
            indices: &mut indices,
        };
        let cells = Cells {
            from: [2, 5],
            to: [4, 8],
        };
        assert_eq!(
            mesh.append_face(0, cells, &view, 0, Coordinates::Box),
            (0, 2 * 3 * 6)
        );
        assert_eq!(mesh.append_sun(Vec3::Z, &view), (36, 6));
        assert_eq!(vertices.len(), 3 * 4 + 4);
        assert!(indices.iter().all(|&i| (i as usize) < vertices.len()));
        // column 2 of 8, row 5 of 8
        assert_eq!(vertices[0].st, Vec2::new(0.25, 1.0 - 0.625));
        assert!((vertices[0].position.x - 1000.0).abs() < 1e-2);
        let sun = &vertices[12..];
        assert!(sun.iter().all(|v| (v.position.z - 1000.0).abs() < 1e-2));
        let diagonal = sun[0].position.distance(sun[2].position);
        assert!((diagonal - 2.0 * 100.0 * 2.0f32.sqrt()).abs() < 1e-2);
    }
}
