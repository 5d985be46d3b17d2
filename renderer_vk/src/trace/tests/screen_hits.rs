//! Bounces that take the light of the last frame's picture.

use glam::Vec3;
use shaders::trace_types::constants as t;

use super::bounces::{furnace, seen};
use super::harness::{Gpu, Scene, bounced, encode, gpu_tests, switch_dlight, through_byte};
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, Settings};

gpu_tests! {
    any: [
        hits_in_the_picture_sum_all_bounces,
        hits_in_the_picture_keep_the_mean,
    ],
    compute: [
        reference_frames_take_no_light_of_the_picture,
        light_in_the_picture_goes_out_with_its_lamp,
    ],
}

/// Frames of a game whose bounces take light of the last frame.
pub(super) fn on_screen(bounces: u32) -> Settings {
    Settings {
        rt_accumulate: false,
        rt_taa: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_bounce_screen: 64,
        rt_bounce_adaptive: 0,
        ..bounced(bounces)
    }
}

/// Mean of the frames from `first` on, red; rays of bounces of the last counted frame.
fn live_mean(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    first: u32,
    frames: u32,
) -> (f32, f32) {
    let mut sum = 0.0;
    let mut add = |frame, pixels: &[Vec3]| {
        if frame >= first {
            sum += pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32;
        }
    };
    gpu.count_rays(true);
    gpu.render_watched(scene, settings, frames, |_, _| {}, Some(&mut add));
    let rays = gpu.rays().expect("counted");
    gpu.count_rays(false);
    let rays = rays[t::COUNT_BOUNCE_RAYS as usize] as f32;
    (sum / (frames - first) as f32, rays)
}

fn hits_in_the_picture_sum_all_bounces(gpu: &mut Gpu) {
    // every wall emits e and reflects a. A ray that hits the picture takes all bounces, another one takes e: with a share s
    // of the first kind a wall receives e / (1 - s a)
    let albedo = 0.5;
    let mut scene = furnace(albedo, 1.0);
    let corner = Vec3::new(-80.0, -78.0, -76.0);
    let wide = Scene::new(corner, Vec3::ZERO, 150.0, 64);
    scene.def = wide.def;
    let [e, a] = [0.25, albedo].map(|v| through_byte(encode(v)));
    let traced = Settings {
        rt_bounce_screen: 0,
        ..on_screen(1)
    };
    let (once, all) = live_mean(gpu, &scene, &traced, 16, 32);
    let (mean, rest) = live_mean(gpu, &scene, &on_screen(1), 32, 64);
    let share = 1.0 - rest / all;
    let exact = seen(e, a, e / (1.0 - share * a));
    println!(
        "hits {share}, one bounce {once} {}, {mean} {exact}",
        seen(e, a, e)
    );
    assert!(share > 0.75, "{share}");
    assert!((once / seen(e, a, e) - 1.0).abs() < 0.005, "{once}");
    assert!((mean / exact - 1.0).abs() < 0.015, "{mean} {exact}");
    // with further bounces, rays that leave the picture miss little
    let (mean, _) = live_mean(gpu, &scene, &on_screen(6), 32, 64);
    let exact = seen(e, a, e / (1.0 - a));
    println!("all bounces {mean} {exact}");
    assert!((mean / exact - 1.0).abs() < 0.008, "{mean} {exact}");
}

/// A hall with pillars and lights.
pub(super) fn lit_hall() -> Scene {
    let mut scene = Scene::hall(40.0, 0.6, 64);
    scene.lamp(Vec3::new(0.0, 60.0, 110.0), 60.0, Vec3::splat(12.0));
    scene.point(Vec3::new(-100.0, -100.0, 0.0), 6000.0, 4.0);
    scene
}

fn hits_in_the_picture_keep_the_mean(gpu: &mut Gpu) {
    let scene = lit_hall();
    let [none, one, many] = [0, 1, 8].map(|n| gpu.mean(&scene, &bounced(n), 64).x);
    let traced = Settings {
        rt_bounce_screen: 0,
        ..on_screen(1)
    };
    let (live, all) = live_mean(gpu, &scene, &traced, 16, 48);
    println!("reference: {none} {one} {many}, live, one bounce: {live}");
    for (steps, thickness) in [
        (16, 2.0),
        (64, 1.0),
        (64, 2.0),
        (64, 4.0),
        (64, 16.0),
        (256, 2.0),
    ] {
        let settings = Settings {
            rt_bounce_screen: steps,
            rt_bounce_thickness: thickness,
            ..on_screen(1)
        };
        let (mean, rest) = live_mean(gpu, &scene, &settings, 16, 48);
        let share = 1.0 - rest / all;
        let (long, _) = live_mean(
            gpu,
            &scene,
            &Settings {
                rt_bounces: 8,
                ..settings.clone()
            },
            16,
            48,
        );
        println!(
            "{steps} steps, thickness {thickness}: hits {share}, mean {mean}, 8 bounces {long}"
        );
        assert!(share > 0.1, "{share}");
        assert!(mean > one && mean < 1.01 * many, "{mean}");
    }
}

fn reference_frames_take_no_light_of_the_picture(gpu: &mut Gpu) {
    let scene = lit_hall();
    let [with, without] = [64, 0].map(|steps| {
        let settings = Settings {
            rt_bounce_screen: steps,
            ..bounced(1)
        };
        gpu.render(&scene, &settings, 3).0
    });
    assert_eq!(with, without);
}

fn light_in_the_picture_goes_out_with_its_lamp(gpu: &mut Gpu) {
    let scene = Scene::hall(40.0, 0.6, 64);
    let lamp = |frame: u32, view: &mut TracedScene| {
        switch_dlight(view, Vec3::new(0.0, -60.0, 60.0), 400.0, frame < 24);
    };
    let mut frames_to_dark = [0u32; 2];
    for (frames, steps) in frames_to_dark.iter_mut().zip([0, 64]) {
        let settings = Settings {
            rt_bounce_screen: steps,
            ..on_screen(1)
        };
        let mut means = Vec::new();
        let mut add = |_, pixels: &[Vec3]| {
            means.push(pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32);
        };
        gpu.render_watched(&scene, &settings, 60, lamp, Some(&mut add));
        let lit = means[23];
        println!("{steps}: {:?}", &means[22..]);
        *frames = means[24..]
            .iter()
            .take_while(|mean| **mean > 0.05 * lit)
            .count() as u32;
        assert!(lit > 0.0);
    }
    println!("{frames_to_dark:?}");
    let [traced, screen] = frames_to_dark;
    assert!(screen <= traced + 4, "{screen} {traced}");
}
