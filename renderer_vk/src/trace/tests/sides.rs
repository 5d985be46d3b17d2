//! One-sided surfaces for primary rays and light rays.

use glam::Vec3;
use shaders::types::constants as c;

use super::harness::{Gpu, Scene, gpu_tests, identity, reference, stage};
use super::layers::screen;
use crate::settings::Settings;

gpu_tests! {
    each: [
        light_passes_what_the_compiler_let_it_pass,
        the_camera_sees_the_shown_side_alone,
    ],
}

/// A rectangle that fills the view, at distance x; it faces away from the camera.
fn turned_away(x: f32) -> [Vec3; 4] {
    let [a, b, c, d] = screen(x);
    [a, d, c, b]
}

/// Source of a scene's light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Lamp,
    Sun,
    Bounce,
}

/// A wall in front of the camera, lit from behind the camera.
fn lit_wall(from: Source) -> Scene {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 20.0, 16);
    let wall = scene.diffuse(0.8);
    scene.quad(screen(100.0), wall);
    match from {
        Source::Lamp => scene.point(Vec3::new(-100.0, 0.0, 0.0), 20_000.0, 8.0),
        Source::Sun => scene.sun(-Vec3::X, 1.0, 0.001),
        Source::Bounce => {
            let glow = scene.material(&[stage::constant([1.0; 3])], c::MATERIAL_TWO_SIDED);
            scene.quad(screen(-60.0), glow);
        }
    }
    scene
}

/// Mean picture with a black shell close before the wall: corners, flags, and whether it is part of the map or of a
/// model.
fn mean(gpu: &mut Gpu, from: Source, shell: Option<([Vec3; 4], u32, bool)>, bounces: u32) -> Vec3 {
    let mut scene = lit_wall(from);
    if let Some((corners, flags, world)) = shell {
        let black = scene.material(&[stage::constant([0.0; 3])], flags);
        if world {
            scene.quad(corners, black);
        } else {
            scene.mesh(corners, black, identity());
        }
    }
    let settings = Settings {
        rt_bounces: if from == Source::Bounce { bounces } else { 0 },
        ..reference()
    };
    gpu.mean(&scene, &settings, 32)
}

/// A shell whose visible side faces the wall, by its winding or by its `cull`.
const BACK: u32 = c::MATERIAL_CULL_BACK;

fn light_passes_what_the_compiler_let_it_pass(gpu: &mut Gpu) {
    for (from, bounces) in [
        (Source::Lamp, 0),
        (Source::Sun, 0),
        (Source::Bounce, 1),
        (Source::Bounce, 2),
    ] {
        let free = mean(gpu, from, None, bounces);
        assert!(free.min_element() > 0.02, "{from:?} {free}");
        let passed = c::MATERIAL_PASSED;
        for (corners, flags, world) in [
            (screen(90.0), BACK | passed, true),
            (turned_away(90.0), passed, true),
            // models have no compiler: the outline shell shows its back
            (screen(90.0), BACK, false),
        ] {
            let lit = mean(gpu, from, Some((corners, flags, world)), bounces);
            let off = (lit / free - 1.0).abs().max_element();
            assert!(
                off < 0.03,
                "{from:?} {bounces} {flags} {world}: {lit} {free}"
            );
        }
        for (corners, flags, world) in [
            // walls of the map stop light from both sides, and so do models with visible fronts
            (screen(90.0), BACK, true),
            (turned_away(90.0), 0, true),
            (turned_away(90.0), passed, false),
        ] {
            let dark = mean(gpu, from, Some((corners, flags, world)), bounces);
            assert_eq!(dark, Vec3::ZERO, "{from:?} {bounces} {flags} {world}");
        }
    }
}

fn the_camera_sees_the_shown_side_alone(gpu: &mut Gpu) {
    for (corners, flags, world) in [
        (screen(90.0), c::MATERIAL_PASSED, true),
        (turned_away(90.0), BACK | c::MATERIAL_PASSED, true),
        (turned_away(90.0), BACK, false),
    ] {
        let seen = mean(gpu, Source::Lamp, Some((corners, flags, world)), 0);
        assert_eq!(seen, Vec3::ZERO, "{flags} {world}");
    }
}
