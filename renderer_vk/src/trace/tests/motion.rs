//! Motion vectors compared with a projection on the CPU.

use glam::{Mat3, Vec2, Vec3};
use shaders::trace_types::SkyRecord;
use shaders::trace_types::constants::{LAST_MOVED, LAST_SAME, LAST_UNKNOWN};
use shaders::types::Instance;
use shaders::types::constants as c;

use super::harness::{
    Gpu, Scene, gpu_tests, identity, mirror_at, rectangle, reference, stage, wall_at,
};
use crate::api::{EntityKind, RefDef};
use crate::scene::{Portal, TracedScene, View, ViewEntity};
use crate::settings::Settings;
use crate::trace::motion::Motion;

gpu_tests! {
    any: [
        motion_is_that_of_the_projection,
    ],
}

const SIZE: i32 = 24;

fn live() -> Settings {
    Settings {
        rt_accumulate: false,
        // through pixel centres
        rt_taa: false,
        ..reference()
    }
}

/// Projection of a point, pixels from the left and the top.
fn seen(def: &RefDef, point: Vec3) -> Vec2 {
    let clip = View::new(def, 4.0, 10000.0).world_to_clip * point.extend(1.0);
    let size = Vec2::new(def.width as f32, def.height as f32);
    (Vec2::new(clip.x, clip.y) / clip.w * 0.5 + 0.5) * size
}

/// Moves and turns the camera in the second frame.
fn step(def: &mut RefDef) {
    def.view_origin += Vec3::new(3.0, -2.0, 1.5);
    let turn = Mat3::from_rotation_z(0.02) * Mat3::from_rotation_y(-0.015);
    def.view_axis = def.view_axis.map(|v| turn * v);
}

/// Compares the motion of every pixel for which `expected` returns the last position (as seen by the camera, in the
/// last frame) with the first camera's projection of that position. Returns the number of these pixels.
fn check(gpu: &Gpu, first: &RefDef, expected: impl Fn(Vec3) -> Option<Vec3>) -> usize {
    let mut known = 0;
    for (i, (place, motion)) in gpu.motion().into_iter().enumerate() {
        let [x, y, z, path] = place;
        let Some(last) = expected(Vec3::new(x, y, z)).filter(|_| path >= 0.0) else {
            continue;
        };
        let pixel = Vec2::new(
            (i as i32 % SIZE) as f32 + 0.5,
            (i as i32 / SIZE) as f32 + 0.5,
        );
        let [u, v, last_view_distance, now] = motion;
        let wanted = seen(first, last);
        let found = pixel + Vec2::new(u, v);
        assert!(
            found.distance(wanted) < 0.1,
            "pixel {pixel}: {found}, not {wanted}"
        );
        let length = last.distance(first.view_origin);
        assert!(
            (last_view_distance - length).abs() < 1.0e-3 * length,
            "{last_view_distance} {length}"
        );
        assert!((now - path).abs() < 1.0e-3 * path, "{now} {path}");
        known += 1;
    }
    known
}

fn motion_is_that_of_the_projection(gpu: &mut Gpu) {
    // one test, because compiling the pipelines takes longer than all of these
    static_geometry_moves_with_the_camera(gpu);
    meshes_move_with_their_entities_and_by_their_vertices(gpu);
    reflections_have_the_motion_of_the_mirror_image(gpu);
    portal_views_have_the_motion_of_the_far_camera(gpu);
    the_sky_turns_but_does_not_come_nearer(gpu);
}

fn room() -> Scene {
    let mut scene = Scene::new(
        Vec3::new(-180.0, 10.0, 20.0),
        Vec3::new(100.0, 0.0, -20.0),
        70.0,
        SIZE,
    );
    let grey = scene.diffuse(0.6);
    scene.ambient = Vec3::ONE;
    scene.room(
        Vec3::new(-200.0, -150.0, -80.0),
        Vec3::new(200.0, 150.0, 120.0),
        grey,
    );
    scene
}

fn static_geometry_moves_with_the_camera(gpu: &mut Gpu) {
    let scene = room();
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        if frame == 1 {
            step(&mut view.def);
        }
    });
    let known = check(gpu, &scene.def, Some);
    assert_eq!(known as i32, SIZE * SIZE);
    // a static camera: exactly no motion
    gpu.render_views(&scene, &live(), 2, |_, _| {});
    for (_, [u, v, last, now]) in gpu.motion() {
        assert_eq!([u, v], [0.0, 0.0]);
        assert_eq!(last, now);
    }
    // the first frame has no history
    gpu.render_views(&scene, &live(), 1, |_, _| {});
    assert!(gpu.motion().iter().all(|(_, m)| m[2] < 0.0));
}

fn meshes_move_with_their_entities_and_by_their_vertices(gpu: &mut Gpu) {
    let mut scene = room();
    let white = scene.diffuse(0.9);
    let screen = wall_at(0.0, 300.0);
    let turn = Mat3::from_rotation_z(0.1);
    scene.mesh(screen, white, identity());
    let bend = |p: Vec3| p + Vec3::X * (0.05 * p.y);
    let (from, to) = (Vec3::new(-20.0, 0.0, 0.0), Vec3::new(-22.0, 4.0, 3.0));
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        view.time = frame as f32 * 0.02;
        let instance = view.instances.last_mut().expect("placed");
        instance.origin = if frame == 0 { from } else { to };
        view.look.entities[0].origin = instance.origin;
        if frame == 1 {
            instance.axis = instance.axis.map(|v| turn * v);
            step(&mut view.def);
            for vertex in &mut view.vertices {
                vertex.position = bend(vertex.position);
                // of the bent plane: light is gathered on the surface that normals imply
                vertex.normal = (vertex.normal - Vec3::Y * (0.05 * vertex.normal.x)).normalize();
            }
        }
    });
    let last = |p: Vec3| {
        let local = turn.transpose() * (p - to);
        let flat = Vec3::new(local.x - 0.05 * local.y, local.y, local.z);
        // beside it the room is visible
        Some(if flat.x.abs() < 0.01 { flat + from } else { p })
    };
    assert_eq!(check(gpu, &scene.def, last) as i32, SIZE * SIZE);

    // an entity that was not nearby has no history
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        view.time = frame as f32 * 0.02;
        let instance = view.instances.last_mut().expect("placed");
        instance.origin = from + Vec3::Z * if frame == 0 { 200.0 } else { 0.0 };
        view.look.entities[0].origin = instance.origin;
    });
    let unknown = gpu.motion().iter().filter(|(_, m)| m[2] < 0.0).count() as i32;
    assert!(unknown > SIZE * SIZE / 2 && unknown < SIZE * SIZE);
}

fn reflections_have_the_motion_of_the_mirror_image(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 50.0, SIZE);
    let white = scene.diffuse(0.9);
    scene.ambient = Vec3::ONE;
    let mirror = scene.material(&[stage::filter([1.0; 3])], c::MATERIAL_PORTAL);
    let around = |x: f32, up: Vec3, aside: Vec3| {
        rectangle(Vec3::new(x, -900.0, -900.0), up * 1800.0, aside * 1800.0)
    };
    scene.quad(around(50.0, Vec3::Z, Vec3::Y), mirror);
    scene.mesh(
        around(-100.0, Vec3::Y, Vec3::Z),
        white,
        Instance {
            flags: c::INSTANCE_THIRD_PERSON,
            ..identity()
        },
    );
    // the mirror comes nearer too, as on a moving brush
    scene.portals.push(mirror_at(50.0, Vec3::NEG_X));
    let moved = Vec3::new(4.0, -3.0, 2.0);
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        view.time = frame as f32 * 0.02;
        if frame == 1 {
            step(&mut view.def);
            view.instances.last_mut().expect("placed").origin = moved;
            view.look.entities[0].origin = moved;
        }
        view.look.portals[0] = mirror_at(if frame == 0 { 49.5 } else { 50.0 }, Vec3::NEG_X);
    });
    let last = |p: Vec3| {
        let then = p - moved;
        Some(Vec3::new(2.0 * 49.5 - then.x, then.y, then.z))
    };
    assert_eq!(check(gpu, &scene.def, last) as i32, SIZE * SIZE);
}

fn portal_views_have_the_motion_of_the_far_camera(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 50.0, SIZE);
    let white = scene.diffuse(0.9);
    scene.ambient = Vec3::ONE;
    let portal = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
    let wall = wall_at(50.0, 900.0);
    scene.quad(wall, portal);
    scene.quad(
        rectangle(
            Vec3::new(4000.0, 300.0, -900.0),
            Vec3::X * 2000.0,
            Vec3::Z * 1800.0,
        ),
        white,
    );
    scene.portals.push(Portal {
        mirror: false,
        camera_origin: Vec3::new(5000.0, 0.0, 0.0),
        camera_axis: [Vec3::NEG_Y, Vec3::X, Vec3::Z],
        ..mirror_at(50.0, Vec3::NEG_X)
    });
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        if frame == 1 {
            step(&mut view.def);
        }
    });
    // 300 in front of the far camera corresponds to 300 behind the portal
    let last = |p: Vec3| Some(Vec3::new(50.0 + p.y, p.x - 5000.0, p.z));
    assert_eq!(check(gpu, &scene.def, last) as i32, SIZE * SIZE);
}

fn the_sky_turns_but_does_not_come_nearer(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 70.0, SIZE);
    let sky = scene.sky(
        &[stage::constant([0.2, 0.1, 1.0])],
        SkyRecord {
            faces: [c::NO_TEXTURE; 6],
            cloud_height: 512.0,
        },
    );
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), sky);
    let turn = Mat3::from_rotation_z(0.03);
    gpu.render_views(&scene, &live(), 2, |frame, view| {
        if frame == 1 {
            view.def.view_origin += Vec3::new(30.0, 20.0, 10.0);
            view.def.view_axis = view.def.view_axis.map(|v| turn * v);
        }
    });
    let half = SIZE as f32 * 0.5;
    let tan = (35.0f32).to_radians().tan();
    for (i, (_, [u, v, last, _])) in gpu.motion().into_iter().enumerate() {
        let pixel = Vec2::new(
            (i as i32 % SIZE) as f32 + 0.5,
            (i as i32 / SIZE) as f32 + 0.5,
        );
        let ndc = (pixel / half - 1.0) * tan;
        let direction = turn * Vec3::new(1.0, -ndc.x, -ndc.y);
        let wanted = seen(&scene.def, direction * 1000.0);
        let found = pixel + Vec2::new(u, v);
        assert!(
            last > 0.0 && found.distance(wanted) < 0.1,
            "{found} {wanted}"
        );
    }
}

/// An entity of a sort at a place.
fn entity(model: i32, origin: Vec3, instance: u32) -> ViewEntity {
    ViewEntity {
        kind: EntityKind::Model,
        model,
        skin: 0,
        material: 0,
        renderfx: 0,
        frame: 0,
        old_frame: 0,
        origin,
        first_instance: instance,
        instance_count: 1,
        first_mesh: 0,
        mesh_count: 0,
    }
}

/// A view of entities without meshes.
fn entities(time: f32, list: &[(i32, Vec3)]) -> TracedScene {
    let def = RefDef::default();
    let mut view = TracedScene::empty(&def, View::new(&def, 4.0, 1000.0));
    view.time = time;
    view.instances.push(identity());
    for (i, (model, origin)) in list.iter().enumerate() {
        view.look
            .entities
            .push(entity(*model, *origin, i as u32 + 1));
        view.instances.push(Instance {
            origin: *origin,
            ..identity()
        });
    }
    view
}

#[test]
fn entities_are_matched_between_frames() {
    let mut motion = Motion::default();
    let at = |x: f32| Vec3::X * x;
    let follow = |motion: &mut Motion, time: f32, list: &[(i32, Vec3)]| -> Vec<(u32, f32)> {
        let view = entities(time, list);
        let matches = motion.matches(&view);
        let found = motion.follow(&view, &[], matches);
        let entity = |i: &shaders::trace_types::LastInstance| (i.known, i.origin.x);
        found.instances[1..].iter().map(entity).collect()
    };
    // new entities have no history
    let first = follow(
        &mut motion,
        0.0,
        &[(1, at(0.0)), (2, at(5.0)), (1, at(20.0))],
    );
    assert!(first.iter().all(|f| f.0 == LAST_UNKNOWN));
    // the nearest one of equal properties, in any order; one is static, one is another model
    let second = follow(
        &mut motion,
        0.02,
        &[(3, at(0.0)), (1, at(30.0)), (1, at(0.0))],
    );
    assert_eq!(
        second,
        [(LAST_UNKNOWN, 0.0), (LAST_MOVED, 20.0), (LAST_SAME, 0.0)]
    );
    // two in a row, one behind the other: the first arrives at the second's old position, and is not mistaken for it
    let mut motion = Motion::default();
    for frame in 0..4 {
        let x = 20.0 * frame as f32;
        let found = follow(
            &mut motion,
            0.02 * frame as f32,
            &[(1, at(x)), (1, at(x + 20.0))],
        );
        if frame > 1 {
            assert_eq!(found, [(LAST_MOVED, x - 20.0), (LAST_MOVED, x)]);
        }
    }
    // through a teleporter
    let found = follow(&mut motion, 0.08, &[(1, at(5000.0))]);
    assert_eq!(found[0].0, LAST_UNKNOWN);
}
