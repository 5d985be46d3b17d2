//! Diagnostics of the traced look: ray counters and debug views.

use glam::Vec3;
use shaders::types::constants as c;

use super::harness::{Gpu, Scene, gpu_tests, identity, rectangle, reference, stage};
use crate::settings::{DebugOutput, DenoiserChoice, LightSelection, Settings};

gpu_tests! {
    each: [
        rays_are_counted_exactly_and_only_when_asked,
        only_rays_near_something_translucent_ask_for_layers,
        a_ray_finds_several_layers,
    ],
    compute: [
        debug_views_show_what_they_say,
        views_of_time_separate_pixels_with_many_rays_from_those_with_few,
    ],
}

const SIZE: u32 = 32;

/// A grey floor that fills the picture, seen from above, under one light.
fn lit_floor() -> Scene {
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 100.0), Vec3::ZERO, 20.0, SIZE as i32);
    let grey = scene.diffuse(0.25);
    let corner = Vec3::new(-500.0, -500.0, 0.0);
    scene.quad(rectangle(corner, Vec3::X * 1000.0, Vec3::Y * 1000.0), grey);
    let up = 60.0;
    scene.light(
        [
            Vec3::new(-10.0, -10.0, up),
            Vec3::new(-10.0, 20.0, up),
            Vec3::new(20.0, -10.0, up),
        ],
        Vec3::ONE,
    );
    scene
}

fn rays_are_counted_exactly_and_only_when_asked(gpu: &mut Gpu) {
    let scene = lit_floor();
    let settings = |bounces| Settings {
        rt_num_random_dl: 0,
        rt_bounces: bounces,
        ..reference()
    };
    gpu.render(&scene, &settings(0), 4);
    assert_eq!(gpu.rays(), None);
    gpu.count_rays(true);
    gpu.render(&scene, &settings(0), 4);
    let rays = gpu.rays().expect("counted");
    let pixels = u64::from(SIZE * SIZE);
    // for each pixel one ray to the floor and one to the light; no rays for layers, because there are none
    assert_eq!(rays, [pixels, 0, pixels, 0, 0, 0, 0, 0, 0, 0]);
    gpu.render(&scene, &settings(1), 4);
    // the floor faces empty space
    let rays = gpu.rays().expect("counted");
    assert_eq!(rays, [pixels, 0, pixels, pixels, 0, 0, 0, 0, 0, 0]);
    // one of 2 x 2 pixels in a denoised picture, a quarter of the rays
    let denoised = Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        ..settings(1)
    };
    gpu.render(&scene, &denoised, 4);
    let rays = gpu.rays().expect("counted");
    assert_eq!(rays, [pixels, 0, pixels, pixels / 4, 0, 0, 0, 0, 0, 0]);
    // three paths in place of one
    let thrice = Settings {
        rt_samples: 3,
        ..denoised
    };
    gpu.render(&scene, &thrice, 4);
    let rays = gpu.rays().expect("counted");
    assert_eq!(rays, [pixels, 0, pixels, 3 * pixels / 4, 0, 0, 0, 0, 0, 0]);
    // rays to the sampled light of each pixel, and to a sun
    let mut sunny = lit_floor();
    sunny.sun(Vec3::Z, 1.0, 0.01);
    let chosen = Settings {
        rt_num_random_dl: 1,
        rt_light_selection: LightSelection::Resampled,
        ..settings(0)
    };
    gpu.render(&sunny, &chosen, 4);
    let rays = gpu.rays().expect("counted");
    assert_eq!(rays, [pixels, 0, pixels, 0, 0, pixels, 0, 0, 0, 0]);
    gpu.count_rays(false);
    gpu.render(&scene, &settings(0), 1);
    assert_eq!(gpu.rays(), None);
}

fn only_rays_near_something_translucent_ask_for_layers(gpu: &mut Gpu) {
    gpu.count_rays(true);
    let settings = Settings {
        rt_num_random_dl: 0,
        rt_bounces: 0,
        ..reference()
    };
    let pixels = u64::from(SIZE * SIZE);
    let mut asked = |moves: bool, side: f32, below: bool| {
        let mut scene = lit_floor();
        let flags = c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED;
        let pane = scene.material(&[stage::blend([0.5; 3], 0.5)], flags);
        let corner = Vec3::new(0.0, 0.0, if below { -10.0 } else { 10.0 });
        let points = rectangle(corner, Vec3::X * side, Vec3::Y * side);
        if moves {
            scene.mesh(points, pane, identity());
        } else {
            scene.quad(points, pane);
        }
        gpu.render(&scene, &settings, 4);
        let [primary_rays, primary, ..] = gpu.rays().expect("counted");
        primary_rays + primary
    };
    for moves in [false, true] {
        // a part of the picture
        let some = asked(moves, 5.0, false);
        assert!(some > pixels && some < 2 * pixels, "{some} of {pixels}");
        assert_eq!(asked(moves, 5.0, true), pixels, "behind the floor");
    }
}

fn a_ray_finds_several_layers(gpu: &mut Gpu) {
    gpu.count_rays(true);
    let pixels = u64::from(SIZE * SIZE);
    let mut asked = |layers: u32| {
        let mut scene = lit_floor();
        let flags = c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED;
        let pane = scene.material(&[stage::blend([0.5; 3], 0.1)], flags);
        for i in 0..layers {
            let corner = Vec3::new(-500.0, -500.0, 1.0 + i as f32);
            let points = rectangle(corner, Vec3::X * 1000.0, Vec3::Y * 1000.0);
            scene.quad(points, pane);
        }
        gpu.render(&scene, &reference(), 4);
        gpu.rays().expect("counted")[1] / pixels
    };
    // a ray for layers finds two; one that finds fewer is the last
    assert_eq!([1, 3, 4, 8].map(&mut asked), [1, 2, 3, 5]);
}

fn debug_views_show_what_they_say(gpu: &mut Gpu) {
    let scene = lit_floor();
    let mut view = |rt_debug| {
        let settings = Settings {
            rt_debug,
            rt_num_random_dl: 0,
            ..reference()
        };
        let (_, picture) = gpu.render(&scene, &settings, 3);
        let middle = picture[(SIZE * SIZE / 2 + SIZE / 2) as usize];
        [middle[0], middle[1], middle[2]]
    };
    let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 2);
    let albedo = view(DebugOutput::Albedo);
    // 0.25 linear is 0.537 display-encoded
    assert!(near(albedo, [137; 3]), "{albedo:?}");
    let normal = view(DebugOutput::Normals);
    assert!(near(normal, [128, 128, 255]), "{normal:?}");
    let depth = view(DebugOutput::Depth);
    // 100 units
    let expected = (255.0 * (1.0 - (100f32.log2() - 3.0) / 10.0)) as u8;
    assert!(near(depth, [expected; 3]), "{depth:?}");
    let motion = view(DebugOutput::Motion);
    assert!(
        motion == [0; 3] || near(motion, [128, 0, 128]),
        "{motion:?}"
    );
    let lights = view(DebugOutput::Lights);
    // one light: a tenth of the scale, three fifths of the way to blue
    assert!(near(lights, [15, 23, 138]), "{lights:?}");
    let rays = view(DebugOutput::Rays);
    // two rays: an eighth of log2(3) of the scale, a fifth of the way from blue to cyan
    assert!(near(rays, [21, 67, 230]), "{rays:?}");
}

fn views_of_time_separate_pixels_with_many_rays_from_those_with_few(gpu: &mut Gpu) {
    const PICTURES: usize = 5;
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 100.0), Vec3::ZERO, 20.0, SIZE as i32);
    let grey = scene.diffuse(0.25);
    let corner = Vec3::new(-500.0, 0.0, 0.0);
    // half of the picture; 32 lights have a ray each
    scene.quad(rectangle(corner, Vec3::X * 1000.0, Vec3::Y * 500.0), grey);
    for i in 0..32 {
        let start = Vec3::new(5.0 * i as f32 - 80.0, 0.0, 60.0);
        scene.light(
            [start, start + Vec3::Y * 4.0, start + Vec3::X * 4.0],
            Vec3::ONE,
        );
    }
    for rt_debug in [DebugOutput::Time, DebugOutput::RayTime] {
        let settings = Settings {
            rt_debug,
            rt_num_random_dl: 0,
            ..reference()
        };
        let (light, _) = gpu.render(&scene, &reference(), 1);
        // the half of the scale above the mean has more red than blue, in most of these pictures: other work on the
        // processor makes some pixels of some pictures slow
        let mut times_long = vec![0; light.len()];
        for _ in 0..PICTURES {
            let (_, picture) = gpu.render(&scene, &settings, 12);
            for (times, color) in times_long.iter_mut().zip(&picture) {
                *times += usize::from(color[0] > color[2]);
            }
        }
        let side = |lit: bool| {
            let pixels = light.iter().zip(&times_long);
            let times: Vec<_> = pixels
                .filter(|(light, _)| (light[0] > 0.0) == lit)
                .map(|(_, &times)| times)
                .collect();
            let long = times.iter().filter(|&&times| times * 2 > PICTURES);
            (long.count(), times.len())
        };
        let ((lit_long, lit), (dark_long, dark)) = (side(true), side(false));
        assert!(lit > 300 && dark > 300, "{lit} lit, {dark} dark pixels");
        let name = format!("{rt_debug:?}: {lit_long} of {lit}, {dark_long} of {dark}");
        assert!(
            lit_long * 10 > lit * 8 && dark_long * 10 < dark * 2,
            "{name}"
        );
    }
}
