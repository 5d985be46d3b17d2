//! Range over which the denoiser detects a change of light.

use glam::Vec3;

use super::harness::{Gpu, Scene, gpu_tests, rectangle, reference};
use crate::api::DynamicLight;
use crate::scene::TracedScene;
use crate::settings::{DebugOutput, DenoiserChoice, Settings};

gpu_tests! {
    compute: [
        a_change_of_light_shortens_history_as_far_as_it_reaches_and_no_farther,
        static_surfaces_have_no_gradient_under_jitter,
        antialiasing_keeps_nothing_of_light_that_fades,
    ],
}

const WIDTH: usize = 192;
const HEIGHT: usize = 24;
/// Edge of a stratum, pixels (`denoise.glsl`).
const STRATUM: usize = 3;
/// Range of a gradient, strata: 12 by the last step, over sums of 6 by those before.
const REACH: usize = 18;

/// A uniformly lit wall. A board before its middle, edge-on to the camera, separates the light of its left from its
/// right.
fn halved_wall() -> Scene {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, WIDTH as i32);
    scene.def.height = HEIGHT as i32;
    let tan = 30f32.to_radians().tan() * HEIGHT as f32 / WIDTH as f32;
    scene.def.fov_y = 2.0 * tan.atan().to_degrees();
    let grey = scene.diffuse(0.5);
    let board = scene.diffuse(0.0);
    let corner = Vec3::new(200.0, -400.0, -400.0);
    scene.quad(rectangle(corner, Vec3::Z * 800.0, Vec3::Y * 800.0), grey);
    let corner = Vec3::new(100.0, 0.0, -400.0);
    let [a, b, c, d] = rectangle(corner, Vec3::Z * 800.0, Vec3::X * 100.0);
    scene.quad([a, b, c, d], board);
    scene.quad([d, c, b, a], board);
    scene.point(Vec3::new(-2000.0, 0.0, 0.0), 2.0e6, 1.0);
    scene
}

fn a_change_of_light_shortens_history_as_far_as_it_reaches_and_no_farther(gpu: &mut Gpu) {
    let scene = halved_wall();
    let settings = Settings {
        rt_accumulate: false,
        rt_taa: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        // all lights, so that a removed one changes nothing where it did not shine
        rt_num_random_dl: 0,
        rt_debug: DebugOutput::Samples,
        ..reference()
    };
    let last = 15;
    let mut history = |lit_until: u32| {
        let lamp = |frame: u32, view: &mut TracedScene| {
            view.dlights.clear();
            if frame < lit_until {
                view.dlights.push(DynamicLight {
                    origin: Vec3::new(180.0, 60.0, 0.0),
                    radius: 200.0,
                    color: Vec3::ONE,
                    ..DynamicLight::default()
                });
            }
        };
        let (_, picture) = gpu.render_views(&scene, &settings, last + 1, lamp);
        picture
    };
    let (never, until_now) = (history(0), history(last));
    // for each column, the pixels whose history differs from that without the lamp
    let changed: Vec<usize> = (0..WIDTH)
        .map(|x| {
            let at = |y: usize| y * WIDTH + x;
            (0..HEIGHT)
                .filter(|&y| never.get(at(y)) != until_now.get(at(y)))
                .count()
        })
        .collect();
    println!("pixels with another history, by column: {changed:?}");
    let edge = WIDTH / 2;
    assert!(
        changed.iter().take(edge).all(|&n| n == HEIGHT),
        "where the lamp shone: {changed:?}"
    );
    // beside it, two thirds of the range: farther than the first steps alone reach
    let beside = changed.iter().skip(edge).take(REACH * 2 / 3 * STRATUM);
    assert!(
        beside.clone().all(|&n| n == HEIGHT),
        "within reach: {changed:?}"
    );
    let beyond = changed.iter().skip(edge + (REACH + 1) * STRATUM);
    assert!(beyond.len() > 30);
    assert!(beyond.clone().all(|&n| n == 0), "beyond reach: {changed:?}");
}

fn static_surfaces_have_no_gradient_under_jitter(gpu: &mut Gpu) {
    // boards leaning on the wall: beside their edges are surfaces at equal distance with other light
    let mut scene = halved_wall();
    let white = scene.diffuse(0.8);
    for i in 0..8u8 {
        let corner = Vec3::new(199.0, -90.0 + 20.0 * f32::from(i), -9.0);
        let edge = Vec3::new(-8.0, 8.0, 0.0);
        scene.quad(rectangle(corner, Vec3::Z * 14.0, edge), white);
    }
    let seen = |rt_debug| Settings {
        rt_accumulate: false,
        rt_taa: true,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_debug,
        ..reference()
    };
    let (_, picture) = gpu.render_views(&scene, &seen(DebugOutput::None), 8, |_, _| {});
    assert!(picture.iter().any(|p| p[0] > 20), "nothing is lit");
    for frames in 3..8 {
        let (_, change) =
            gpu.render_views(&scene, &seen(DebugOutput::Gradients), frames, |_, _| {});
        let changed = change.iter().filter(|p| p[..3] != [0; 3]).count();
        assert_eq!(changed, 0, "pixels that changed in frame {frames}");
    }
}

fn antialiasing_keeps_nothing_of_light_that_fades(gpu: &mut Gpu) {
    // stripes slightly wider than pixels, whose contrast exceeds the light of a few frames
    let mut scene = halved_wall();
    let colors = [0.2, 0.9].map(|albedo| scene.diffuse(albedo));
    for (i, color) in (0..70u8).zip(colors.into_iter().cycle()) {
        let corner = Vec3::new(199.0, 2.0 * f32::from(i), -50.0);
        scene.quad(rectangle(corner, Vec3::Z * 100.0, Vec3::Y * 2.0), color);
    }
    let brightness = |gpu: &mut Gpu, rt_taa: bool, dims: bool| {
        let settings = Settings {
            rt_accumulate: false,
            rt_taa,
            rt_denoiser: DenoiserChoice::ASvgf,
            // all lights, so that there is no noise
            rt_num_random_dl: 0,
            ..reference()
        };
        let lamp = |frame: u32, view: &mut TracedScene| {
            let left = if dims {
                0.94f32.powi(frame as i32)
            } else {
                1.0
            };
            view.dlights = vec![DynamicLight {
                origin: Vec3::new(170.0, 60.0, 0.0),
                radius: 200.0,
                color: Vec3::splat(0.2 * left),
                ..DynamicLight::default()
            }];
        };
        let (light, _) = gpu.render_views(&scene, &settings, 32, lamp);
        let left = |(i, light): (usize, &Vec3)| (i % WIDTH < WIDTH / 2).then_some(light.x);
        light.iter().enumerate().filter_map(left).sum::<f32>()
    };
    let steady = brightness(gpu, true, false) / brightness(gpu, false, false);
    let fading = brightness(gpu, true, true) / brightness(gpu, false, true);
    println!("with antialiasing over without: steady {steady}, fading {fading}");
    assert!((fading / steady - 1.0).abs() < 0.03, "{fading}, {steady}");
}
