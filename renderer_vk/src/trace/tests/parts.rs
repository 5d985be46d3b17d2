//! How the meshes of a view are sorted for rays.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Instance, MaterialBuffers, Vertex};

use crate::api::RefDef;
use crate::scene::{DynamicMesh, RigidMesh, Shape, View, ViewScene};
use crate::trace::cutout::Coverage;
use crate::trace::input::{Kind, MaterialInfo, MaterialTable};
use crate::trace::part_mesh;
use crate::trace::parts::Parts;

/// One cut-out: left of 0.5 it is there, right of 1 there is nothing.
struct CutOut;

impl MaterialTable for CutOut {
    fn info(&self, index: u32) -> (u32, MaterialInfo) {
        let flags = c::MATERIAL_CUT_OUT;
        let info = MaterialInfo {
            flags,
            ..MaterialInfo::default()
        };
        (index, info)
    }
    fn coverage(&self, _material: u32, corners: [Vec2; 3]) -> Coverage {
        if corners.iter().all(|st| st.x < 0.5) {
            Coverage::Solid
        } else if corners.iter().all(|st| st.x > 1.0) {
            Coverage::Hole
        } else {
            Coverage::Mixed
        }
    }
    fn buffers(&self) -> MaterialBuffers {
        MaterialBuffers::default()
    }
    fn sky_sampler(&self) -> u32 {
        0
    }
    fn generation(&self) -> u64 {
        1
    }
}

/// A strip of triangles, each three corners of its own at the given texture coordinates.
fn strip(st: &[f32]) -> RigidMesh {
    let vertices = st.iter().enumerate().flat_map(|(i, &s)| {
        [Vec3::ZERO, Vec3::X, Vec3::Y].map(|corner| Vertex {
            position: corner + Vec3::Z * i as f32,
            normal: Vec3::Z,
            st: Vec2::new(s, 0.0),
            lightmap: Vec2::ZERO,
            color: u32::MAX,
        })
    });
    let vertices: Vec<Vertex> = vertices.collect();
    let indices = (0..vertices.len() as u32).collect();
    RigidMesh::new(vertices, indices)
}

fn parts_of(mesh: RigidMesh) -> Vec<(Kind, Vec<[u32; 3]>)> {
    let def = RefDef {
        width: 8,
        height: 8,
        fov_x: 90.0,
        fov_y: 90.0,
        ..RefDef::default()
    };
    let mut view = ViewScene::empty(&def, View::new(&def, 4.0, 100.0));
    view.instances.push(Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        ..Instance::default()
    });
    view.rigid.push(Arc::new(mesh));
    view.meshes.push(DynamicMesh {
        first_index: 0,
        index_count: 0,
        first_vertex: 0,
        vertex_count: 0,
        material: 0,
        instance: 0,
        fog: 0,
        world_surface: None,
        shape: Shape::Rigid(0),
    });
    let mut parts = Parts::default();
    // known from the second time on
    for _ in 0..2 {
        parts.collect(&view, &CutOut);
    }
    let shown = parts.parts.iter().map(|part| {
        let members = part_mesh::members(&view, &parts, part);
        (part.kind, part_mesh::part_indices(&members))
    });
    shown.collect()
}

#[test]
fn only_triangles_with_holes_are_tested() {
    let triangle = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    let mut mixed = parts_of(strip(&[0.2, 0.7, 1.5, 0.3, 0.8]));
    mixed.sort_by_key(|part| part.1.first().copied());
    assert_eq!(
        mixed,
        [
            (Kind::Opaque, vec![triangle(0), triangle(3)]),
            (Kind::Tested, vec![triangle(1), triangle(4)]),
        ]
    );
    assert_eq!(
        parts_of(strip(&[0.7, 0.6])),
        [(Kind::Tested, vec![triangle(0), triangle(1)])]
    );
    assert_eq!(parts_of(strip(&[0.1])), [(Kind::Opaque, vec![triangle(0)])]);
    assert_eq!(parts_of(strip(&[1.2])), []);
}
