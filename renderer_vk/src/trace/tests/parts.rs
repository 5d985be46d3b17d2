//! Sorting of a view's meshes for rays.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Instance, MaterialBuffers, Vertex};

use crate::api::RefDef;
use crate::scene::{DynamicMesh, RigidMesh, Shape, TracedScene, View};
use crate::trace::cutout::Coverage;
use crate::trace::input::{Kind, MaterialInfo, MaterialTable};
use crate::trace::part_mesh;
use crate::trace::parts::Parts;

/// Alpha coverage, by material number: solid left of 0.5, empty right of 1; both limits move right with the number.
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
    fn coverage(&self, material: u32, corners: [Vec2; 3]) -> Coverage {
        let moved = material as f32;
        if corners.iter().all(|st| st.x < moved + 0.5) {
            Coverage::Solid
        } else if corners.iter().all(|st| st.x > moved + 1.0) {
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

/// A strip of separate triangles at the given texture coordinates.
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
    let parts = parts_of_skins(mesh, &[0], Vec3::Z);
    parts.into_iter().map(|(_, kind, of)| (kind, of)).collect()
}

/// Instance numbers, kinds and triangles of entities of one model, one for each skin; `up`: their third axis.
fn parts_of_skins(mesh: RigidMesh, skins: &[u32], up: Vec3) -> Vec<(u32, Kind, Vec<[u32; 3]>)> {
    let def = RefDef {
        width: 8,
        height: 8,
        fov_x: 90.0,
        fov_y: 90.0,
        ..RefDef::default()
    };
    let mut view = TracedScene::empty(&def, View::new(&def, 4.0, 100.0));
    view.look.rigid.push(Arc::new(mesh));
    for (instance, &material) in skins.iter().enumerate() {
        view.instances.push(Instance {
            axis: [Vec3::X, Vec3::Y, up],
            ..Instance::default()
        });
        view.meshes.push(DynamicMesh {
            first_index: 0,
            index_count: 0,
            first_vertex: 0,
            vertex_count: 0,
            material,
            instance: instance as u32,
            fog: 0,
            world_surface: None,
            shape: Shape::Rigid(0),
            paths: 0,
        });
    }
    let mut parts = Parts::default();
    // the second time from the stored coverage
    for _ in 0..2 {
        parts.collect(&view, &CutOut);
    }
    let shown = parts.parts.iter().map(|part| {
        let members = part_mesh::members(&view, &parts, part);
        let indices = part_mesh::part_indices(&members);
        (part.instance, part.kind, indices)
    });
    shown.collect()
}

#[test]
fn skins_of_one_model_have_holes_of_their_own() {
    let triangle = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    let mut parts = parts_of_skins(strip(&[0.2, 0.7, 1.2, 1.7]), &[0, 1, 0], Vec3::Z);
    parts.sort_by_key(|(instance, _, of)| (*instance, of.first().copied()));
    let first = |instance| {
        [
            (instance, Kind::Opaque, vec![triangle(0)]),
            (instance, Kind::Tested, vec![triangle(1)]),
        ]
    };
    let second = [
        (1, Kind::Opaque, vec![triangle(0), triangle(1), triangle(2)]),
        (1, Kind::Tested, vec![triangle(3)]),
    ];
    assert_eq!(parts, [first(0), second, first(2)].concat());
}

#[test]
fn instances_without_volume_are_omitted() {
    let mesh = || strip(&[0.2, 0.7]);
    assert_eq!(parts_of_skins(mesh(), &[0], Vec3::Z * 0.01).len(), 2);
    assert_eq!(parts_of_skins(mesh(), &[0], Vec3::ZERO), []);
    assert_eq!(parts_of_skins(mesh(), &[0], Vec3::X), []);
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
