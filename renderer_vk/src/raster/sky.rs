//! The sky of the classic look: a box around the eye, and cloud layers projected from a sphere onto it.
//!
//! Source: the engine's sky as described in its behaviour: faces and their texture axes, a dome over a planet of
//! radius 4096 for the clouds, depth at the far end.

use glam::{Vec2, Vec3};
use shaders::types::Vertex;

/// Cells of a face along each side, at whose corners cloud coordinates are computed.
const CELLS: usize = 8;
/// Radius of the planet under the clouds, units.
const PLANET_RADIUS: f32 = 4096.0;

/// Number of faces, in the order of the box's images: right, left, back, front, up, down.
pub const FACES: usize = 6;

/// The point of face `face` of the cube [-1, 1]³ at texture parameters `s`, `t` in [-1, 1].
pub fn cube_point(face: usize, s: f32, t: f32) -> Vec3 {
    match face {
        0 => Vec3::new(1.0, -s, t),
        1 => Vec3::new(s, 1.0, t),
        2 => Vec3::new(-1.0, s, t),
        3 => Vec3::new(-s, -1.0, t),
        4 => Vec3::new(-t, -s, 1.0),
        _ => Vec3::new(t, -s, -1.0),
    }
}

/// Coordinates on the cloud layer in `direction` (any length), clouds `height` above the ground.
pub fn cloud_coordinates(direction: Vec3, height: f32) -> Vec2 {
    let r = PLANET_RADIUS;
    let d2 = direction.length_squared();
    let root = direction.z * direction.z * r * r + d2 * (2.0 * r * height + height * height);
    let p = (-direction.z * r + root.max(0.0).sqrt()) / d2;
    let v = (direction * p + Vec3::new(0.0, 0.0, r)).normalize();
    Vec2::new(v.x.clamp(-1.0, 1.0).acos(), v.y.clamp(-1.0, 1.0).acos())
}

/// Which coordinates a face gets.
#[derive(Clone, Copy, Debug)]
pub enum Coordinates {
    /// The box's image of that face.
    Box,
    /// The cloud layer at this height.
    Clouds(f32),
}

/// Appends one face around `eye`, `size` units away, and returns the range of its indices.
pub fn append_face(
    vertices: &mut Vec<Vertex>,
    indices: &mut Vec<u32>,
    face: usize,
    eye: Vec3,
    size: f32,
    color: u32,
    coordinates: Coordinates,
) -> (u32, u32) {
    let first_vertex = vertices.len() as u32;
    let first_index = indices.len() as u32;
    for row in 0..=CELLS {
        for column in 0..=CELLS {
            let s = column as f32 / CELLS as f32 * 2.0 - 1.0;
            let t = row as f32 / CELLS as f32 * 2.0 - 1.0;
            let point = cube_point(face, s, t);
            let st = match coordinates {
                Coordinates::Box => Vec2::new((s + 1.0) * 0.5, 1.0 - (t + 1.0) * 0.5),
                Coordinates::Clouds(height) => cloud_coordinates(point, height),
            };
            vertices.push(Vertex {
                position: eye + point * size,
                normal: -point.normalize(),
                st,
                lightmap: Vec2::ZERO,
                color,
            });
        }
    }
    let width = CELLS as u32 + 1;
    for row in 0..CELLS as u32 {
        for column in 0..CELLS as u32 {
            let a = first_vertex + row * width + column;
            indices.extend([a, a + width, a + 1, a + 1, a + width, a + width + 1]);
        }
    }
    (first_index, indices.len() as u32 - first_index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_lie_on_the_cube() {
        for face in 0..FACES {
            let p = cube_point(face, 0.25, -0.5);
            assert_eq!(p.abs().max_element(), 1.0, "face {face}: {p}");
        }
    }

    #[test]
    fn clouds_overhead_are_at_a_quarter_turn() {
        // straight up, the unit vector to the layer is (0, 0, 1), whose x and y are 0: acos 0
        let uv = cloud_coordinates(Vec3::Z, 512.0);
        assert!((uv - Vec2::splat(std::f32::consts::FRAC_PI_2)).length() < 1e-6);
        // to the east the layer is met at sqrt(2 R h + h^2) units
        let uv = cloud_coordinates(Vec3::X, 512.0);
        let reach = (2.0_f32 * 4096.0 * 512.0 + 512.0 * 512.0).sqrt();
        let expected = (reach / (4096.0 + 512.0)).acos();
        assert!((uv.x - expected).abs() < 1e-5, "{uv} {expected}");
    }
}
