//! Selects the triangles that a dynamic light reaches. The others would be drawn without effect, at the cost of a
//! texture sample per pixel.

use glam::{Mat3, Vec3};
use shaders::types::{Instance, Vertex};

use crate::api::DynamicLight;

/// A dynamic light in the space of an instance.
pub struct LightReach {
    /// Position of the light along the instance's axes.
    origin: Vec3,
    /// Transforms a point of the instance to coordinates along its axes.
    along_axes: Mat3,
    /// Half the size of the box around the light outside which it has no effect, units.
    half: Vec3,
}

impl LightReach {
    /// The spot of a light relative to an instance: a square column along the instance's z axis, as wide as the light's
    /// radius and twice as high (`draw.vert`).
    pub fn spot(light: &DynamicLight, instance: &Instance) -> Self {
        Self::new(light, instance, Vec3::new(0.5, 0.5, 1.0) * light.radius)
    }

    /// The sphere of a light that is evaluated per pixel.
    pub fn sphere(light: &DynamicLight, instance: &Instance) -> Self {
        Self::new(light, instance, Vec3::splat(light.radius))
    }

    fn new(light: &DynamicLight, instance: &Instance, half: Vec3) -> Self {
        let axes = Mat3::from_cols_array_2d(&instance.axis.map(|axis| axis.to_array()));
        let onto = axes.transpose();
        Self {
            origin: onto * (light.origin - instance.origin),
            along_axes: onto * axes,
            half,
        }
    }

    /// Appends the triangles of `indices` that the light may reach.
    pub fn gather(&self, vertices: &[Vertex], indices: &[u32], found: &mut Vec<u32>) {
        for corners in indices.chunks_exact(3) {
            let beyond = corners.iter().fold(u32::MAX, |all, &index| {
                all & vertices
                    .get(index as usize)
                    .map_or(0, |vertex| self.beyond(vertex.position))
            });
            if beyond == 0 {
                found.extend_from_slice(corners);
            }
        }
    }

    /// One bit for each side of the box beyond which a point lies.
    fn beyond(&self, point: Vec3) -> u32 {
        let delta = self.origin - self.along_axes * point;
        delta.cmplt(-self.half).bitmask() | delta.cmpgt(self.half).bitmask() << 3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::vertex;

    #[test]
    fn triangles_wholly_beyond_one_side_are_left_out() {
        let light = DynamicLight {
            origin: Vec3::new(100.0, 10.0, 0.0),
            radius: 20.0,
            color: Vec3::ONE,
            ..DynamicLight::default()
        };
        // rotated by a quarter turn and scaled by 2: the light is at (5, -50, 0) in instance space
        let instance = Instance {
            axis: [Vec3::Y * 2.0, Vec3::NEG_X * 2.0, Vec3::Z * 2.0],
            ..Instance::default()
        };
        let reach = LightReach::spot(&light, &instance);
        let vertices = [
            // around the light
            vertex(0.0, -52.0, 0.0),
            vertex(10.0, -52.0, 0.0),
            vertex(5.0, -48.0, 0.0),
            // beyond x
            vertex(8.0, -50.0, 0.0),
            vertex(9.0, -50.0, 0.0),
            vertex(8.0, -49.0, 0.0),
            // beyond two sides, but not completely beyond one
            vertex(20.0, -50.0, 0.0),
            vertex(5.0, -30.0, 0.0),
            vertex(20.0, -30.0, 0.0),
            // above
            vertex(5.0, -50.0, 11.0),
            vertex(6.0, -50.0, 12.0),
            vertex(5.0, -51.0, 13.0),
        ];
        let indices: Vec<u32> = (0..12).chain([99, 3, 4]).collect();
        let mut found = Vec::new();
        reach.gather(&vertices, &indices, &mut found);
        // triangles with an index out of range are kept
        assert_eq!(found, [0, 1, 2, 6, 7, 8, 99, 3, 4]);
        // the sphere is wider than the spot
        found.clear();
        LightReach::sphere(&light, &instance).gather(&vertices, &indices, &mut found);
        assert_eq!(found, [0, 1, 2, 3, 4, 5, 6, 7, 8, 99, 3, 4]);
    }
}
