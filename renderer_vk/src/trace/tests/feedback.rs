//! Feedback of rays on structures: what is counted, and pictures beside those without feedback.

use std::sync::Arc;

use glam::Vec3;
use shaders::types::constants as c;

use super::harness::{
    Gpu, Scene, floor_at, gpu_tests, identity, mirror_at, rectangle, stage, wall_at,
};
use crate::scene::{MeshId, RigidMesh, Shape, TracedScene};
use crate::settings::{DenoiserChoice, HitFeedback, Settings};
use crate::statistics::MovingCost;
use crate::trace::view_tracer::ViewTracer;

gpu_tests! {
    each: [
        rays_of_eye_and_shadow_count_what_they_hit,
        counting_and_feedback_leave_a_scene_at_rest_as_it_is,
        bodies_that_move_unseen_are_right_when_they_enter_the_view,
        a_body_in_a_mirror_is_right_after_two_frames,
        instances_that_the_gpu_lists_are_those_that_the_cpu_writes,
    ],
}

const SIZE: i32 = 48;

/// Frames until the bodies rest.
const REST: u32 = 24;

fn live(rt_hit_feedback: HitFeedback) -> Settings {
    Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::None,
        rt_taa: false,
        rt_hit_feedback,
        ..super::harness::reference()
    }
}

/// Adds a rectangle whose vertices may move.
fn animated(scene: &mut Scene, points: [Vec3; 4], material: u32) {
    scene.mesh(points, material, identity());
    let mesh = scene.meshes.last_mut().expect("added");
    mesh.shape = Shape::Animated(MeshId {
        model: mesh.instance as i32,
        level: 0,
        surface: 0,
    });
}

/// Adds a rectangle of constant shape.
fn rigid(scene: &mut Scene, points: [Vec3; 4], material: u32) {
    scene.mesh(points, material, identity());
    let mesh = scene.meshes.last_mut().expect("added");
    let vertices = scene.dynamic_vertices.split_off(mesh.first_vertex as usize);
    let indices = scene.dynamic_indices.split_off(mesh.first_index as usize);
    let indices = indices.iter().map(|i| i - mesh.first_vertex).collect();
    (mesh.vertex_count, mesh.index_count) = (0, 0);
    mesh.shape = Shape::Rigid(scene.rigid.len() as u32);
    (scene.rigid).push(Arc::new(RigidMesh::new(vertices, indices)));
}

/// A square that faces +x, around the x axis.
fn behind(x: f32, half: f32) -> [Vec3; 4] {
    let corner = Vec3::new(x, -half, -half);
    rectangle(corner, Vec3::Y * (2.0 * half), Vec3::Z * (2.0 * half))
}

/// The linear picture of each frame, and the cost of the structures.
fn frames(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    number: u32,
    change: impl Fn(u32, &mut TracedScene),
) -> (Vec<Vec<Vec3>>, MovingCost) {
    // with the random numbers of the first frames
    gpu.look = ViewTracer::new(&gpu.passes).expect("a device");
    let mut pictures = Vec::new();
    let mut watch = |_: u32, picture: &[Vec3]| pictures.push(picture.to_vec());
    gpu.render_watched(scene, settings, number, change, Some(&mut watch));
    (pictures, gpu.look.moving_cost())
}

fn rays_of_eye_and_shadow_count_what_they_hit(gpu: &mut Gpu) {
    let camera = Vec3::new(-100.0, 0.0, 60.0);
    let mut scene = Scene::new(camera, Vec3::new(20.0, 0.0, 0.0), 40.0, SIZE);
    let grey = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 500.0), grey);
    scene.point(Vec3::new(20.0, 0.0, 400.0), 100_000.0, 4.0);
    // in sight; between floor and lamp; nowhere
    animated(&mut scene, floor_at(1.0, 8.0), grey);
    animated(&mut scene, floor_at(300.0, 20.0), grey);
    animated(&mut scene, behind(-400.0, 40.0), grey);
    let number = 6;
    let (_, cost) = frames(gpu, &scene, &live(HitFeedback::Counts), number, |_, _| {});
    // the last two frames are not read
    assert_eq!(cost.counted, u64::from(3 * (number - 2)));
    assert_eq!(cost.unmet, u64::from(number - 2));
    assert_eq!((cost.parts, cost.refits), (18, 18));
    assert_eq!((cost.bodies, cost.left_out), (18, 0));
    let (_, off) = frames(gpu, &scene, &live(HitFeedback::None), number, |_, _| {});
    assert_eq!((off.counted, off.refits), (0, 18));
}

/// A room with a body in sight, one behind the camera, and one in a closed box.
fn hall() -> Scene {
    let mut scene = Scene::hall(40.0, 0.6, SIZE);
    scene.point(Vec3::new(-20.0, 60.0, 90.0), 20_000.0, 4.0);
    scene.ambient = Vec3::splat(0.05);
    let red = scene.material(&[stage::light(), stage::filter([0.9, 0.3, 0.3])], 0);
    let grey = scene.diffuse(0.3);
    animated(&mut scene, floor_at(-60.0, 30.0), red);
    animated(&mut scene, behind(-195.0, 30.0), red);
    let low = Vec3::new(600.0, 600.0, 600.0);
    scene.block(low, low + 200.0, grey);
    scene.room(low, low + 200.0, grey);
    let inside = rectangle(low + 80.0, Vec3::X * 30.0, Vec3::Y * 30.0);
    animated(&mut scene, inside, red);
    scene
}

fn counting_and_feedback_leave_a_scene_at_rest_as_it_is(gpu: &mut Gpu) {
    let scene = hall();
    let number = 2 * REST;
    let none = Settings {
        rt_bounces: 1,
        ..live(HitFeedback::None)
    };
    let with = |rt_hit_feedback| Settings {
        rt_hit_feedback,
        ..none.clone()
    };
    let (plain, _) = frames(gpu, &scene, &none, number, |_, _| {});
    let (counted, cost) = frames(gpu, &scene, &with(HitFeedback::Counts), number, |_, _| {});
    assert!(plain == counted, "counting changes the picture");
    assert_eq!((cost.left_out, cost.refits), (0, cost.parts));
    let (fed, cost) = frames(gpu, &scene, &with(HitFeedback::Acts), number, |_, _| {});
    assert!(plain == fed, "feedback changes a scene at rest");
    // one body is left out once it has been quiet
    let left_out = u64::from(number - 12)..=u64::from(number - 8);
    assert!(left_out.contains(&cost.left_out), "{cost:?}");
    assert!(
        cost.parts + cost.left_out == u64::from(3 * number),
        "{cost:?}"
    );
}

/// Moves all vertices of a view's bodies.
fn wave(frame: u32, view: &mut TracedScene, scene: &Scene) {
    view.time = frame as f32 * 0.02;
    let size = 1.0 + 0.3 * (frame as f32 * 0.7).sin();
    for (vertex, start) in view.vertices.iter_mut().zip(&scene.dynamic_vertices) {
        vertex.position.y = start.position.y * size;
    }
}

fn turn(view: &mut TracedScene, back: bool) {
    let sign = if back { -1.0 } else { 1.0 };
    view.def.view_axis = [Vec3::X * sign, Vec3::Y * sign, Vec3::Z];
}

fn bodies_that_move_unseen_are_right_when_they_enter_the_view(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let grey = scene.diffuse(0.2);
    scene.room(Vec3::splat(-900.0), Vec3::splat(900.0), grey);
    scene.ambient = Vec3::ONE;
    let white = scene.diffuse(0.9);
    animated(&mut scene, wall_at(200.0, 40.0), white);
    animated(&mut scene, behind(-200.0, 40.0), white);
    let path = |frame: u32, view: &mut TracedScene| {
        wave(frame, view, &scene);
        turn(view, (REST..2 * REST).contains(&frame));
    };
    let number = 2 * REST + 2;
    let (plain, _) = frames(gpu, &scene, &live(HitFeedback::None), number, path);
    let (fed, cost) = frames(gpu, &scene, &live(HitFeedback::Acts), number, path);
    for (frame, (a, b)) in plain.iter().zip(&fed).enumerate() {
        assert!(a == b, "frame {frame}");
    }
    // one of both bodies is left out, but for the frames until the counts show that it is unseen
    assert!(cost.left_out > u64::from(number / 2), "{cost:?}");
    // the picture moves
    assert!(plain[4] != plain[6] && plain[REST as usize + 4] != plain[REST as usize + 8]);
}

fn a_body_in_a_mirror_is_right_after_two_frames(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let grey = scene.diffuse(0.2);
    scene.room(Vec3::splat(-900.0), Vec3::splat(900.0), grey);
    scene.ambient = Vec3::ONE;
    let white = scene.diffuse(0.9);
    let mirror = scene.material(&[stage::filter([1.0; 3])], c::MATERIAL_PORTAL);
    scene.quad(wall_at(50.0, 200.0), mirror);
    animated(&mut scene, behind(-200.0, 40.0), white);
    let shown = mirror_at(50.0, Vec3::NEG_X);
    let path = |frame: u32, view: &mut TracedScene| {
        wave(frame, view, &scene);
        view.look.portals.clear();
        if frame >= REST {
            view.look.portals.push(shown);
        }
    };
    let number = REST + 8;
    let (plain, _) = frames(gpu, &scene, &live(HitFeedback::None), number, path);
    let (fed, cost) = frames(gpu, &scene, &live(HitFeedback::Acts), number, path);
    assert!(cost.left_out > 0, "{cost:?}");
    let differs: Vec<usize> = (0..plain.len()).filter(|&i| plain[i] != fed[i]).collect();
    // the counts of a frame are read two frames later
    assert_eq!(differs, [REST as usize, REST as usize + 1]);
}

fn instances_that_the_gpu_lists_are_those_that_the_cpu_writes(gpu: &mut Gpu) {
    let mut scene = Scene::hall(60.0, 0.6, SIZE);
    scene.point(Vec3::new(-20.0, 60.0, 90.0), 20_000.0, 4.0);
    scene.ambient = Vec3::splat(0.05);
    let red = scene.material(&[stage::light(), stage::filter([0.9, 0.3, 0.3])], 0);
    const BODIES: u32 = 40;
    for i in 0..BODIES {
        let points = floor_at(-60.0 + i as f32, 3.0).map(|p| p + Vec3::Y * (i as f32 * 4.0 - 80.0));
        match i % 8 {
            0 => animated(&mut scene, points, red),
            _ => rigid(&mut scene, points, red),
        }
    }
    let all = scene.view();
    // one body moves in each frame; some go, and come back
    let path = |frame: u32, view: &mut TracedScene| {
        let first = view.look.entities[0].first_instance;
        let moved = (first + frame * 5 % BODIES) as usize;
        view.instances[moved].origin.z += 7.0;
        view.meshes.clone_from(&all.meshes);
        view.look.entities.clone_from(&all.look.entities);
        if (6..12).contains(&frame) {
            // an entity has one mesh
            let left = all.meshes.len() - frame as usize;
            view.meshes.truncate(left);
            view.look.entities.truncate(left);
        }
    };
    let number = 18;
    let (plain, cpu) = frames(gpu, &scene, &live(HitFeedback::None), number, path);
    let (listed, kept) = frames(gpu, &scene, &live(HitFeedback::Counts), number, path);
    for (frame, (a, b)) in plain.iter().zip(&listed).enumerate() {
        assert!(a == b, "frame {frame}");
    }
    assert!(plain[0] != plain[8]);
    assert_eq!(
        (cpu.written, kept.instances),
        (cpu.instances, cpu.instances)
    );
    // the first list, what moves, what is animated: our own structures of these have new addresses
    let most = u64::from(BODIES + number * (1 + BODIES.div_ceil(8))) + 8;
    assert!(kept.written < most, "{kept:?}");
    assert!(kept.written > u64::from(BODIES + number / 2), "{kept:?}");
}
