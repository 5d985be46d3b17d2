//! Kept structures render the same as structures built in the frame.

use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Instance, Vertex};
use testkit::Random;

use super::harness::{Gpu, Scene, gpu_tests, identity, reference, stage};
use crate::scene::{DynamicMesh, MeshId, RigidMesh, Shape};
use crate::settings::Settings;
use crate::trace::accel::Accel;
use crate::trace::tracer::Tracer;

gpu_tests! {
    each: [
        kept_structures_show_what_built_ones_show,
        entities_of_one_model_may_have_triangles_of_their_own,
        non_finite_geometry_is_never_hit,
    ],
}

/// Random triangles within a cube of 40 units, some of them degenerate.
fn shards(seed: u64, triangles: usize) -> (Vec<Vertex>, Vec<u32>) {
    let mut random = Random::new(seed);
    let mut vertices = Vec::new();
    for i in 0..triangles {
        let middle = random.signed_point() * 20.0;
        let mut corners = [0; 3].map(|_| middle + random.signed_point() * 12.0);
        match i % 16 {
            0 => corners[2] = corners[1],
            8 => corners = [middle; 3],
            _ => {}
        }
        vertices.extend(corners.map(|position| Vertex {
            position,
            normal: Vec3::Z,
            st: Vec2::ZERO,
            lightmap: Vec2::ZERO,
            color: u32::MAX,
        }));
    }
    let indices = (0..3 * triangles as u32).collect();
    (vertices, indices)
}

/// How a mesh is added.
#[derive(Clone, Copy, PartialEq)]
enum How {
    Changing,
    Animated,
    Rigid,
}

fn add(
    scene: &mut Scene,
    how: How,
    rigid: &Arc<RigidMesh>,
    id: i32,
    material: u32,
    instance: Instance,
) {
    let index = scene.instances.len() as u32;
    scene.instances.push(instance);
    let mut mesh = DynamicMesh {
        first_index: scene.dynamic_indices.len() as u32,
        index_count: 0,
        first_vertex: scene.dynamic_vertices.len() as u32,
        vertex_count: 0,
        material,
        instance: index,
        fog: 0,
        world_surface: None,
        shape: Shape::Changing,
        paths: 0,
    };
    if how == How::Rigid {
        mesh.shape = Shape::Rigid(scene.rigid.len() as u32);
        scene.rigid.push(Arc::clone(rigid));
    } else {
        if how == How::Animated {
            mesh.shape = Shape::Animated(MeshId {
                model: id,
                level: 0,
                surface: 0,
            });
        }
        mesh.vertex_count = rigid.vertices.len() as u32;
        mesh.index_count = rigid.indices.len() as u32;
        scene.dynamic_vertices.extend(&rigid.vertices);
        let indices = rigid.indices.iter().map(|i| i + mesh.first_vertex);
        scene.dynamic_indices.extend(indices);
    }
    scene.meshes.push(mesh);
}

fn turned(random: &mut Random) -> Instance {
    let turn = Mat3::from_rotation_y(random.uniform() * 6.0)
        * Mat3::from_rotation_x(random.uniform() * 6.0)
        * (0.4 + random.uniform());
    Instance {
        axis: [turn.x_axis, turn.y_axis, turn.z_axis],
        origin: random.signed_point() * Vec3::new(60.0, 90.0, 70.0),
        ..identity()
    }
}

fn stage_scene() -> Scene {
    let mut scene = Scene::new(Vec3::new(-220.0, 0.0, 30.0), Vec3::ZERO, 70.0, 48);
    let grey = scene.diffuse(0.5);
    scene.room(Vec3::splat(-230.0), Vec3::splat(230.0), grey);
    scene.ambient = Vec3::splat(0.2);
    let lamp = Vec3::new(-60.0, -40.0, 225.0);
    let corners = [lamp, lamp + Vec3::Y * 80.0, lamp + Vec3::X * 80.0];
    scene.light(corners, Vec3::splat(20.0));
    scene
}

/// Number of differing pixels: rays that graze an edge may hit or miss it.
fn differing(a: &[Vec3], b: &[Vec3]) -> usize {
    let pairs = a.iter().zip(b);
    pairs
        .filter(|(a, b)| (**a - **b).abs().max_element() > 0.02 * a.max_element().max(0.1))
        .count()
}

fn settings() -> Settings {
    reference()
}

fn kept_structures_show_what_built_ones_show(gpu: &mut Gpu) {
    let mut last: Option<Vec<Vec3>> = None;
    // poses from near to far from the first: refitted, and rebuilt after large changes
    for (pose, stretch) in [1.0, 1.05, 1.2, 6.0, 0.3].into_iter().enumerate() {
        let mut pictures = Vec::new();
        for how in [How::Changing, How::Rigid, How::Animated] {
            let mut scene = stage_scene();
            let solid = scene.diffuse(0.8);
            let veil = scene.material(
                &[stage::blend([0.2, 0.4, 1.0], 0.4)],
                c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
            );
            for model in 0..3u32 {
                let (mut vertices, indices) = shards(u64::from(model) + 7, 24);
                let mut random = Random::new(pose as u64);
                for vertex in &mut vertices {
                    let shake = random.signed_point() * 4.0 * pose as f32;
                    vertex.position = vertex.position * Vec3::new(stretch, 1.0, 1.0) + shake;
                }
                let rigid = Arc::new(RigidMesh::new(vertices, indices));
                let mut places = Random::new(u64::from(model));
                for entity in 0..3 {
                    let material = if entity == 2 { veil } else { solid };
                    let instance = turned(&mut places);
                    add(
                        &mut scene,
                        how,
                        &rigid,
                        model as i32 + 1,
                        material,
                        instance,
                    );
                }
            }
            pictures.push(gpu.render(&scene, &settings(), 1).0);
        }
        for (kept, name) in pictures[1..].iter().zip(["rigid", "animated"]) {
            let count = differing(&pictures[0], kept);
            println!("pose {pose} {name}: {count} of {} differ", kept.len());
            assert!(count < kept.len() / 60, "{name}: {count}");
        }
        if let Some(last) = &last {
            assert!(differing(&pictures[0], last) > 50, "the poses differ");
        }
        last = Some(pictures.swap_remove(0));
    }
    // three models of two kinds, in five poses as rigid ones, each built once
    assert_eq!(gpu.look.accel.counts(), [5 * 3 * 2, 3 * 3]);
}

fn entities_of_one_model_may_have_triangles_of_their_own(gpu: &mut Gpu) {
    for frame in 0..2 {
        let pictures = [How::Changing, How::Animated].map(|how| {
            let mut scene = stage_scene();
            let solid = scene.diffuse(0.8);
            let mut places = Random::new(frame);
            for half in 0..2 {
                let (vertices, mut indices) = shards(5, 24);
                indices.drain(half * 36..half * 36 + 36);
                let mesh = Arc::new(RigidMesh::new(vertices, indices));
                let small = turned(&mut places);
                let large = Instance {
                    axis: small.axis.map(|side| side * 3.0),
                    ..small
                };
                add(&mut scene, how, &mesh, 1, solid, large);
            }
            gpu.render(&scene, &settings(), 1).0
        });
        let count = differing(&pictures[0], &pictures[1]);
        println!("frame {frame}: {count} of {} differ", pictures[0].len());
        assert!(count < pictures[0].len() / 60, "{frame}: {count}");
    }
}

#[test]
fn a_thousand_entities_of_one_model_share_one_structure() {
    Gpu::with(&[Tracer::Pipeline, Tracer::Compute], |mut gpu| {
        let tracer = gpu.tracer;
        let mut scene = stage_scene();
        let solid = scene.diffuse(0.8);
        let (vertices, indices) = shards(3, 200);
        let rigid = Arc::new(RigidMesh::new(vertices, indices));
        let mut random = Random::new(1);
        for _ in 0..1000 {
            let instance = turned(&mut random);
            add(&mut scene, How::Rigid, &rigid, 1, solid, instance);
        }
        // small deformed surfaces of the map are built together, a large one is refitted
        for triangles in [20, 30, 500] {
            let (vertices, indices) = shards(4, triangles);
            let surface = Arc::new(RigidMesh::new(vertices, indices));
            let id = triangles as i32;
            add(&mut scene, How::Animated, &surface, id, solid, identity());
            scene.meshes.last_mut().expect("added").world_surface = Some(triangles as u32);
        }
        let uploaded = scene.upload(&gpu.device, tracer);
        let mut accel = Accel::new(&gpu.device, tracer);
        let view = scene.view();
        let mut before = None;
        for frame in 0..6 {
            let mut rec = gpu.ring.begin().expect("frame");
            accel
                .record(
                    &mut rec,
                    &view,
                    Some(&uploaded.geometry),
                    &uploaded.materials,
                )
                .expect("recorded");
            gpu.ring.end(rec).expect("submitted");
            assert_eq!(accel.counts(), [1, 1]);
            let models = accel.memory().models;
            match frame {
                0 => before = Some(models),
                // compacted once the GPU has reported the sizes
                _ => assert!(Some(models) <= before, "{models}"),
            }
        }
        gpu.device.wait_idle().expect("done");
        gpu.check_messages();
    });
}

fn non_finite_geometry_is_never_hit(gpu: &mut Gpu) {
    let empty = gpu.render(&stage_scene(), &settings(), 1).0;
    for how in [How::Changing, How::Animated] {
        for bad in [f32::NAN, f32::INFINITY, 3.0e38] {
            let mut scene = stage_scene();
            let solid = scene.diffuse(0.8);
            let (mut vertices, mut indices) = shards(5, 8);
            for (i, vertex) in vertices.iter_mut().enumerate() {
                // one corner of each triangle
                if i % 3 == 0 {
                    vertex.position = Vec3::new(bad, 0.0, bad);
                }
            }
            // an invalid vertex index
            indices.extend([0, 1, 4_000_000]);
            let mesh = Arc::new(RigidMesh::new(vertices, indices));
            let far = bad.is_finite();
            let instance = Instance {
                axis: [Vec3::X, Vec3::Y, Vec3::Z * if far { 10.0 } else { 1.0 }],
                ..identity()
            };
            add(&mut scene, how, &mesh, 9, solid, instance);
            // an instance without volume
            let (vertices, indices) = shards(6, 8);
            let mesh = Arc::new(RigidMesh::new(vertices, indices));
            let nowhere = Instance {
                axis: [Vec3::X, Vec3::Y, Vec3::ZERO],
                origin: Vec3::splat(f32::NAN),
                ..identity()
            };
            add(&mut scene, how, &mesh, 10, solid, nowhere);
            add(&mut scene, How::Rigid, &mesh, 10, solid, nowhere);
            let picture = gpu.render(&scene, &settings(), 1).0;
            if !far {
                assert_eq!(differing(&empty, &picture), 0);
            }
        }
    }
}

#[test]
fn maps_come_and_go_without_a_trace() {
    Gpu::with(&[Tracer::Pipeline, Tracer::Compute], |mut gpu| {
        let tracer = gpu.tracer;
        let mut reports = Vec::new();
        for map in 0..200u32 {
            let mut scene = stage_scene();
            let solid = scene.diffuse(0.8);
            let mut random = Random::new(u64::from(map));
            let uploaded = scene.upload(&gpu.device, tracer);
            let mut accel = Accel::new(&gpu.device, tracer);
            for frame in 0..2 {
                let (vertices, indices) = shards(frame, 30);
                let mesh = Arc::new(RigidMesh::new(vertices, indices));
                for how in [How::Changing, How::Animated, How::Rigid] {
                    add(&mut scene, how, &mesh, 1, solid, turned(&mut random));
                }
                let mut rec = gpu.ring.begin().expect("frame");
                accel
                    .record(
                        &mut rec,
                        &scene.view(),
                        Some(&uploaded.geometry),
                        &uploaded.materials,
                    )
                    .expect("recorded");
                gpu.ring.end(rec).expect("submitted");
            }
            drop((accel, uploaded));
            gpu.device.wait_idle().expect("done");
            reports.push(gpu.device.memory_report());
        }
        assert_eq!(reports[10], reports[199]);
        gpu.check_messages();
    });
}
