//! Debug polygons of the engine's collision code (`r_debugSurface`).

use glam::{Vec2, Vec3};
use shaders::types::Vertex;

/// Polygons of a view, world space.
#[derive(Clone, Debug, Default)]
pub struct DebugPolygons {
    /// Corners of all polygons, with their colour.
    pub vertices: Vec<Vertex>,
    /// Number of corners of each polygon.
    pub sizes: Vec<u32>,
}

impl DebugPolygons {
    /// Removes all polygons.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.sizes.clear();
    }

    /// Adds a convex polygon if it faces `camera`: its front winds clockwise. The lowest three bits of `color` are red,
    /// green and blue.
    pub fn add(&mut self, color: u32, corners: &[Vec3], camera: Vec3) {
        let [a, b, c, ..] = *corners else {
            return; // no area
        };
        let normal = (c - a).cross(b - a);
        let finite = corners.iter().all(|corner| corner.is_finite());
        let Some(size) = u32::try_from(corners.len()).ok().filter(|_| finite) else {
            return; // a corner is not finite
        };
        if normal.dot(camera - a) <= 0.0 {
            return;
        }
        let channel = |bit: u32| (((color >> bit) & 1) * 0xFF) << (8 * bit);
        let color = 0xFF00_0000 | channel(0) | channel(1) | channel(2);
        self.vertices.extend(corners.iter().map(|&position| Vertex {
            position,
            normal,
            st: Vec2::ZERO,
            lightmap: Vec2::ZERO,
            color,
        }));
        self.sizes.push(size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_from_behind_or_is_no_polygon_is_left_out() {
        let corners = [Vec3::ZERO, Vec3::Y, Vec3::X];
        let mut polygons = DebugPolygons::default();
        polygons.add(5, &corners, Vec3::NEG_Z);
        polygons.add(5, &corners[..2], Vec3::Z);
        polygons.add(5, &[Vec3::NAN; 3], Vec3::Z);
        assert!(polygons.sizes.is_empty() && polygons.vertices.is_empty());
        polygons.add(5, &corners, Vec3::Z);
        assert_eq!(polygons.sizes, [3]);
        assert_eq!(polygons.vertices[0].color, 0xFFFF_00FF);
    }
}
