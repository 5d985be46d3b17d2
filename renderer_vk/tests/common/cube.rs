//! A model of a cube, and the end of tests that draw it.

use glam::{Vec2, Vec3};
use q3model::{Frame, Md3, PackedVertex, Surface};
use renderer_vk::Renderer;

/// An MD3 file of a cube around its origin with edges of `2 * half` units; its material is `t/body`.
pub fn cube_model(half: f32) -> Vec<u8> {
    let corner = |i: u8| {
        let side = |bit: u8| if i >> bit & 1 == 0 { -half } else { half };
        Vec3::new(side(0), side(1), side(2))
    };
    let corners: Vec<Vec3> = (0..8u8).map(corner).collect();
    Md3 {
        name: "box".into(),
        frames: vec![Frame {
            mins: Vec3::splat(-half),
            maxs: Vec3::splat(half),
            local_origin: Vec3::ZERO,
            radius: half * 3f32.sqrt(),
            name: String::new(),
        }],
        tags: Vec::new(),
        num_tags: 0,
        surfaces: vec![Surface {
            name: "body".into(),
            shaders: vec!["t/body".into()],
            triangles: testkit::cube_triangles().collect(),
            st: vec![Vec2::ZERO; 8],
            vertices: corners
                .iter()
                .map(|p| PackedVertex::pack(*p, p.normalize()))
                .collect(),
            num_verts: 8,
        }],
    }
    .write()
}

/// Fails if the validation layer has found something; for the `Drop` of what holds the renderer.
pub fn check_validation(renderer: &Renderer) {
    let messages = renderer.validation_messages();
    if !std::thread::panicking() {
        assert!(messages.is_empty(), "validation: {messages:#?}");
    }
}
