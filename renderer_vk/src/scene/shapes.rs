//! Entities that are built on the CPU in world space: sprites, beams, rails, lightning.
//!
//! Source: engine behaviour of `renderer_opengl1` (entity surfaces), quirks included: a beam begins at the world's
//! origin, the first corner of a rail's core is dim.

use glam::{Quat, Vec2, Vec3};
use shaders::types::Vertex;

use super::View;
use crate::api::RefEntity;
use crate::settings::Settings;

/// Half-width of a lightning bolt, units.
const LIGHTNING_WIDTH: f32 = 8.0;
/// Quads of a lightning bolt.
const LIGHTNING_QUADS: usize = 4;
/// Number of sides of a beam, and its radius, units.
const BEAM_SIDES: u32 = 6;
const BEAM_RADIUS: f32 = 4.0;
/// Length of a rail's core for one repetition of its texture, units.
const RAIL_TEXTURE_LENGTH: f32 = 256.0;
/// Length of a rail trail at which rings end, units: twice the largest map, so that only invalid entities reach it.
const MAX_RAIL_LENGTH: f32 = 262_144.0;
/// Length of the axes drawn for a missing model, units, and half their width, pixels.
const AXIS_LENGTH: f32 = 16.0;
const AXIS_HALF_WIDTH: f32 = 1.5;

/// Appends geometry to a view.
pub(super) struct MeshBuilder<'a> {
    /// The view's vertices.
    pub vertices: &'a mut Vec<Vertex>,
    /// The view's indices; they count from the start of `vertices`.
    pub indices: &'a mut Vec<u32>,
}

fn packed(rgba: [u8; 4]) -> u32 {
    u32::from_le_bytes(rgba)
}

impl MeshBuilder<'_> {
    fn vertex(&mut self, position: Vec3, normal: Vec3, st: Vec2, color: u32) {
        self.vertices.push(Vertex {
            position,
            normal,
            st,
            // the engine's quads have equal texture and lightmap coordinates
            lightmap: st,
            color,
        });
    }

    fn next(&self) -> u32 {
        u32::try_from(self.vertices.len()).unwrap_or(u32::MAX)
    }

    /// A quad that faces the camera, rotated by the entity.
    pub fn sprite(&mut self, entity: &RefEntity, view: &View) {
        let [forward, axis_left, axis_up] = view.axis;
        let radius = entity.radius;
        let (sine, cosine) = entity.rotation.to_radians().sin_cos();
        let mut left = radius * (cosine * axis_left - sine * axis_up);
        let up = radius * (cosine * axis_up + sine * axis_left);
        if view.mirrored {
            left = -left;
        }
        let corners = [left + up, up - left, -left - up, left - up];
        self.quad(
            corners.map(|corner| entity.origin + corner),
            -forward,
            [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            packed(entity.shader_rgba),
        );
    }

    /// A quad, by its corners in winding order.
    fn quad(&mut self, corners: [Vec3; 4], normal: Vec3, st: [Vec2; 4], color: u32) {
        let base = self.next();
        for (corner, st) in corners.into_iter().zip(st) {
            self.vertex(corner, normal, st, color);
        }
        self.indices.extend([0, 1, 3, 3, 1, 2].map(|i| base + i));
    }

    /// A red tube. The engine does not translate it to the entity's position (a bug that this keeps).
    pub fn beam(&mut self, entity: &RefEntity) {
        let along = entity.old_origin - entity.origin;
        let Some(direction) = along.try_normalize() else {
            return; // no length
        };
        let spoke = perpendicular(direction) * BEAM_RADIUS;
        let base = self.next();
        for side in 0..BEAM_SIDES {
            let angle = std::f32::consts::TAU * side as f32 / BEAM_SIDES as f32;
            let start = Quat::from_axis_angle(direction, angle) * spoke;
            let normal = start / BEAM_RADIUS;
            self.vertex(start, normal, Vec2::ZERO, u32::MAX);
            self.vertex(start + along, normal, Vec2::ZERO, u32::MAX);
        }
        for side in 0..BEAM_SIDES {
            let next = (side + 1) % BEAM_SIDES;
            let [a, b, c, d] = [side * 2, side * 2 + 1, next * 2, next * 2 + 1].map(|i| base + i);
            self.indices.extend([a, b, c, c, b, d]);
        }
    }

    /// The core of a rail trail, from `old_origin` to `origin`.
    pub fn rail_core(&mut self, entity: &RefEntity, view: &View, settings: &Settings) {
        let (start, end) = (entity.old_origin, entity.origin);
        let side = side_of_line(start, end, view.origin);
        let width = settings.rail_core_width.trunc();
        self.core(start, end, side, width, entity.shader_rgba);
    }

    /// A bolt: four crossed quads from `origin` to `old_origin`.
    pub fn lightning(&mut self, entity: &RefEntity, view: &View) {
        let (start, end) = (entity.origin, entity.old_origin);
        let mut side = side_of_line(start, end, view.origin);
        let direction = (end - start).normalize_or_zero();
        let turn = if direction == Vec3::ZERO {
            Quat::IDENTITY
        } else {
            Quat::from_axis_angle(direction, std::f32::consts::FRAC_PI_4)
        };
        for _ in 0..LIGHTNING_QUADS {
            self.core(start, end, side, LIGHTNING_WIDTH, entity.shader_rgba);
            side = turn * side;
        }
    }

    fn core(&mut self, start: Vec3, end: Vec3, side: Vec3, width: f32, rgba: [u8; 4]) {
        // the engine leaves alpha undefined; it is mostly opaque
        let [r, g, b, _] = rgba;
        let color = packed([r, g, b, 255]);
        let dim = packed([r / 4, g / 4, b / 4, 255]);
        let s = (end - start).length().trunc() / RAIL_TEXTURE_LENGTH;
        let normal = side.cross(end - start).normalize_or(Vec3::Z);
        let base = self.next();
        self.vertex(start + side * width, normal, Vec2::ZERO, dim);
        self.vertex(start - side * width, normal, Vec2::Y, color);
        self.vertex(end + side * width, normal, Vec2::new(s, 0.0), color);
        self.vertex(end - side * width, normal, Vec2::new(s, 1.0), color);
        self.indices.extend([0, 1, 2, 2, 1, 3].map(|i| base + i));
    }

    /// Rings around a rail trail, from `old_origin` to `origin`.
    pub fn rail_rings(&mut self, entity: &RefEntity, settings: &Settings) {
        let (start, end) = (entity.old_origin, entity.origin);
        let length = (end - start).length().min(MAX_RAIL_LENGTH);
        let direction = (end - start).normalize_or_zero();
        // the engine would divide by zero
        let spacing = settings.rail_segment_length.max(1.0);
        let step = direction * spacing;
        let mut count = ((length / spacing) as u32).max(1);
        if count > 1 {
            count -= 1;
        }
        let (right, up) = normal_vectors(direction);
        let radius = 0.25 * settings.rail_width.trunc();
        let mut corners: [Vec3; 4] = std::array::from_fn(|i| {
            let angle = (45.0 + 90.0 * i as f32).to_radians();
            start + (right * angle.cos() + up * angle.sin()) * radius
        });
        if count > 1 {
            corners = corners.map(|c| c + step);
        }
        let [r, g, b, _] = entity.shader_rgba;
        let st = [Vec2::X, Vec2::ONE, Vec2::Y, Vec2::ZERO];
        for _ in 0..count {
            self.quad(corners, direction, st, packed([r, g, b, 255]));
            corners = corners.map(|c| c + step);
        }
    }

    /// Red, green and blue axes of an entity, as lines of constant width in pixels.
    pub fn axes(&mut self, entity: &RefEntity, view: &View) {
        let colors = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]];
        for (axis, color) in entity.axis.into_iter().zip(colors) {
            let end = entity.origin + axis * AXIS_LENGTH;
            self.pixel_line(entity.origin, end, packed(color), view);
        }
    }

    /// A line of a width in pixels, as OpenGL draws it: a steep line has that width horizontally,
    /// another line vertically.
    fn pixel_line(&mut self, from: Vec3, to: Vec3, color: u32, view: &View) {
        let [forward, left, up] = view.axis;
        let [from_depth, to_depth] = [from, to].map(|p| forward.dot(p - view.origin));
        // clips the line at the near plane
        let near = view.near;
        let (from, to) = match (from_depth < near, to_depth < near) {
            (false, false) => (from, to),
            (true, true) => return,
            (behind, _) => {
                let on_plane = from.lerp(to, (near - from_depth) / (to_depth - from_depth));
                if behind {
                    (on_plane, to)
                } else {
                    (from, on_plane)
                }
            }
        };
        let [_, _, width, height] = view.viewport.map(|side| side.max(1) as f32);
        // size of a pixel at distance 1, units
        let (across, down) = (2.0 * view.tan_x / width, 2.0 * view.tan_y / height);
        let pixels = |p: Vec3| {
            let seen = p - view.origin;
            let depth = forward.dot(seen);
            Vec2::new(left.dot(seen) / across, up.dot(seen) / down) / depth
        };
        let direction = (pixels(to) - pixels(from)).abs();
        let wide = if direction.x < direction.y {
            left * across
        } else {
            up * down
        } * AXIS_HALF_WIDTH;
        let side = |p: Vec3| wide * forward.dot(p - view.origin);
        let corners = [
            from + side(from),
            to + side(to),
            to - side(to),
            from - side(from),
        ];
        self.quad(corners, -forward, [Vec2::ZERO; 4], color);
    }
}

/// Unit vector perpendicular to a line and to the view direction; zero if the camera is on the line.
fn side_of_line(start: Vec3, end: Vec3, camera: Vec3) -> Vec3 {
    let to_start = (start - camera).normalize_or_zero();
    let to_end = (end - camera).normalize_or_zero();
    to_start.cross(to_end).normalize_or_zero()
}

/// Two unit vectors perpendicular to a direction, as the engine chooses them.
fn normal_vectors(forward: Vec3) -> (Vec3, Vec3) {
    let turned = Vec3::new(forward.z, -forward.x, forward.y);
    let right = (turned - turned.dot(forward) * forward).normalize_or_zero();
    (right, right.cross(forward))
}

/// A unit vector perpendicular to a unit vector: the axis of its smallest component, projected.
pub(crate) fn perpendicular(direction: Vec3) -> Vec3 {
    let size = direction.abs();
    let axis = if size.x <= size.y && size.x <= size.z {
        Vec3::X
    } else if size.y <= size.z {
        Vec3::Y
    } else {
        Vec3::Z
    };
    (axis - axis.dot(direction) * direction).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::RefDef;

    fn build(make: impl FnOnce(&mut MeshBuilder<'_>)) -> (Vec<Vertex>, Vec<u32>) {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        make(&mut MeshBuilder {
            vertices: &mut vertices,
            indices: &mut indices,
        });
        assert!(indices.iter().all(|&i| (i as usize) < vertices.len()));
        (vertices, indices)
    }

    #[test]
    fn sprite_corners_face_the_camera() {
        let view = View::new(&RefDef::default(), 4.0, 1000.0);
        let entity = RefEntity {
            origin: Vec3::new(100.0, 0.0, 0.0),
            radius: 10.0,
            shader_rgba: [1, 2, 3, 4],
            ..RefEntity::default()
        };
        let (vertices, indices) = build(|m| m.sprite(&entity, &view));
        let expected = [(10.0, 10.0), (-10.0, 10.0), (-10.0, -10.0), (10.0, -10.0)];
        for (v, (y, z)) in vertices.iter().zip(expected) {
            assert!(
                v.position.abs_diff_eq(Vec3::new(100.0, y, z), 1e-4),
                "{v:?}"
            );
            assert_eq!(v.normal, -Vec3::X);
            assert_eq!(v.color, 0x0403_0201);
        }
        assert_eq!(indices.len(), 6);
        // a quarter turn moves the upper left corner to the lower left
        let turned = RefEntity {
            rotation: 90.0,
            ..entity
        };
        let (vertices, _) = build(|m| m.sprite(&turned, &view));
        assert!(
            vertices[0]
                .position
                .abs_diff_eq(Vec3::new(100.0, 10.0, -10.0), 1e-4)
        );
    }

    #[test]
    fn rails_and_bolts() {
        let view = View::new(&RefDef::default(), 4.0, 1000.0);
        let settings = Settings::default();
        let entity = RefEntity {
            origin: Vec3::new(100.0, -50.0, 0.0),
            old_origin: Vec3::new(100.0, 50.0, 0.0),
            shader_rgba: [200, 100, 40, 7],
            ..RefEntity::default()
        };
        let (core, _) = build(|m| m.rail_core(&entity, &view, &settings));
        assert_eq!(core[0].color.to_le_bytes(), [50, 25, 10, 255]);
        assert_eq!(core[1].color.to_le_bytes(), [200, 100, 40, 255]);
        assert!((core[0].position - core[1].position).length() - 12.0 < 1e-4);
        assert!((core[3].st.x - 100.0 / 256.0).abs() < 1e-6);
        let (rings, _) = build(|m| m.rail_rings(&entity, &settings));
        assert_eq!(rings.len(), 4 * 2);
        assert!((rings[0].position.y - (50.0 - 32.0)).abs() < 1e-4);
        let (bolt, _) = build(|m| m.lightning(&entity, &view));
        assert_eq!(bolt.len(), 16);
        let (beam, triangles) = build(|m| m.beam(&entity));
        assert_eq!((beam.len(), triangles.len()), (12, 36));
        assert!(beam.iter().all(|v| v.position.x.abs() <= 4.001));
    }

    #[test]
    fn degenerate_shapes_stay_finite() {
        let view = View::new(&RefDef::default(), 4.0, 1000.0);
        let settings = Settings::default();
        let entity = RefEntity::default();
        let (vertices, _) = build(|m| {
            m.sprite(&entity, &view);
            m.beam(&entity);
            m.rail_core(&entity, &view, &settings);
            m.rail_rings(&entity, &settings);
            m.lightning(&entity, &view);
            m.axes(&entity, &view);
        });
        assert!(
            vertices
                .iter()
                .all(|v| v.position.is_finite() && v.normal.is_finite())
        );
    }

    #[test]
    fn lines_are_pixels_wide() {
        let def = RefDef {
            width: 200,
            height: 100,
            fov_x: 90.0,
            fov_y: 2.0 * 0.5f32.atan().to_degrees(),
            ..RefDef::default()
        };
        let view = View::new(&def, 4.0, 1000.0);
        let (flat, steep) = (Vec3::new(50.0, 20.0, 5.0), Vec3::new(50.0, 5.0, 20.0));
        let start = Vec3::X * 100.0;
        let width = |to: Vec3| {
            let (vertices, _) = build(|m| m.pixel_line(start, to, 1, &view));
            let [a, b, c, d] = [0, 1, 2, 3].map(|i: usize| {
                let clip = view.world_to_clip * vertices[i].position.extend(1.0);
                Vec2::new(clip.x * 100.0, clip.y * 50.0) / clip.w
            });
            [(a - d).abs(), (b - c).abs()]
        };
        for found in width(flat) {
            assert!(found.abs_diff_eq(Vec2::new(0.0, 3.0), 1e-3), "{found}");
        }
        for found in width(steep) {
            assert!(found.abs_diff_eq(Vec2::new(3.0, 0.0), 1e-3), "{found}");
        }
        // clipped at the near plane, whichever end is behind it
        for (from, to) in [(start, -start), (-start, start)] {
            let (vertices, _) = build(|m| m.pixel_line(from, to, 1, &view));
            let nearest = vertices.iter().map(|v| v.position.x).fold(1e9, f32::min);
            assert!((nearest - 4.0).abs() < 1e-3, "{nearest}");
        }
        let (none, _) = build(|m| m.pixel_line(-start, -start * 2.0, 1, &view));
        assert!(none.is_empty());
    }

    #[test]
    fn perpendicular_is() {
        for v in [Vec3::X, Vec3::Y, -Vec3::Z, Vec3::ONE.normalize()] {
            let p = perpendicular(v);
            assert!(p.dot(v).abs() < 1e-6 && (p.length() - 1.0).abs() < 1e-5);
        }
    }
}
