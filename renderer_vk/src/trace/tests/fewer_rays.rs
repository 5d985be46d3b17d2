//! Bounces that only some pixels trace, and paths that end where they have found light.

use glam::Vec3;
use shaders::trace_types::constants as t;

use super::bounces::{furnace, seen};
use super::harness::{Gpu, Scene, bounced, encode, gpu_tests, switch_dlight, through_byte};
use super::screen_hits::{lit_hall, on_screen};
use crate::api::RefDef;
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, Settings};

gpu_tests! {
    any: [
        roulette_by_light_keeps_the_mean,
    ],
    compute: [
        pixels_at_rest_trace_seldom_and_keep_the_mean,
        bounced_light_that_changes_is_traced_at_once,
    ],
}

/// Frames of a game in which a pixel with this many samples traces seldom; 0: always.
fn adaptive(samples: u32) -> Settings {
    Settings {
        rt_bounce_screen: 0,
        rt_bounce_adaptive: samples,
        ..on_screen(1)
    }
}

/// Means of each frame's picture, red, and rays of bounces of each frame, a few frames late.
fn watched(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    frames: u32,
    change: impl Fn(u32, &mut TracedScene),
) -> (Vec<f32>, u64) {
    let mut means = Vec::new();
    let mut add = |_, pixels: &[Vec3]| {
        means.push(pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32);
    };
    gpu.count_rays(true);
    gpu.render_watched(scene, settings, frames, change, Some(&mut add));
    let rays = gpu.rays().expect("counted");
    gpu.count_rays(false);
    (means, rays[t::COUNT_BOUNCE_RAYS as usize])
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

fn pixels_at_rest_trace_seldom_and_keep_the_mean(gpu: &mut Gpu) {
    let mut scene = lit_hall();
    (scene.def.width, scene.def.height) = (96, 96);
    let (all, full) = watched(gpu, &scene, &adaptive(0), 72, |_, _| {});
    for samples in [4, 16, 28] {
        let (some, rest) = watched(gpu, &scene, &adaptive(samples), 72, |_, _| {});
        let (before, after) = (mean(&all[36..]), mean(&some[36..]));
        println!("{samples}: rays {rest} of {full}, mean {after} {before}");
        assert!(rest * 3 < full, "{rest} {full}");
        assert!((after / before - 1.0).abs() < 0.01, "{after} {before}");
    }
    let place = |frame: u32, view: &mut TracedScene| {
        let def: &mut RefDef = &mut view.def;
        def.view_origin = scene.def.view_origin + Vec3::new(2.0, 0.7, 0.1) * frame as f32;
    };
    let (all, full) = watched(gpu, &scene, &adaptive(0), 48, place);
    let (some, moving) = watched(gpu, &scene, &adaptive(16), 48, place);
    println!(
        "moving: rays {moving} of {full}, {} {}",
        mean(&some[24..]),
        mean(&all[24..])
    );
    assert!((mean(&some[24..]) / mean(&all[24..]) - 1.0).abs() < 0.015);
}

fn bounced_light_that_changes_is_traced_at_once(gpu: &mut Gpu) {
    let mut scene = Scene::hall(40.0, 0.6, 96);
    scene.point(Vec3::new(-100.0, -100.0, 0.0), 600.0, 4.0);
    let lamp = |frame: u32, view: &mut TracedScene| {
        switch_dlight(
            view,
            Vec3::new(0.0, -60.0, 60.0),
            400.0,
            (40..80).contains(&frame),
        );
    };
    let [all, some] = [0, 16].map(|samples| watched(gpu, &scene, &adaptive(samples), 110, lamp).0);
    println!("on  {:?}\n    {:?}", &all[38..50], &some[38..50]);
    println!("off {:?}\n    {:?}", &all[78..92], &some[78..92]);
    let (dark, lit) = (mean(&all[30..40]), mean(&all[70..80]));
    for after in [43, 83] {
        for (frame, (all, some)) in all.iter().zip(&some).enumerate().skip(after).take(20) {
            let error = (all - some).abs() / (lit - dark);
            println!("frame {frame}: {error}");
            assert!(error < 0.02, "frame {frame}: {some} instead of {all}");
        }
    }
}

fn roulette_by_light_keeps_the_mean(gpu: &mut Gpu) {
    for albedo in [0.5, 1.0] {
        let scene = furnace(albedo, 1.0);
        let [e, a] = [0.25, albedo].map(|v| through_byte(encode(v)));
        for (bounces, frames) in [(1, 128), (4, 256)] {
            let light: f32 = (0..bounces).map(|n| e * a.powi(n)).sum();
            let exact = seen(e, a, light);
            let settings = Settings {
                rt_bounce_roulette: true,
                ..bounced(bounces as u32)
            };
            let reference = gpu.mean(&scene, &settings, frames).x;
            // unfiltered: the filter takes the few bright samples of long paths for outliers
            let live = Settings {
                rt_accumulate: false,
                rt_taa: false,
                rt_denoiser: DenoiserChoice::None,
                ..settings.clone()
            };
            let live = mean(&watched(gpu, &scene, &live, frames, |_, _| {}).0);
            println!("albedo {albedo}, {bounces}: {reference} {live} {exact}");
            assert!(
                (reference / exact - 1.0).abs() < 0.01,
                "{reference} {exact}"
            );
            assert!((live / exact - 1.0).abs() < 0.01, "{live} {exact}");
        }
    }
    let scene = lit_hall();
    let rays = [false, true].map(|roulette| {
        let settings = Settings {
            rt_bounce_roulette: roulette,
            ..adaptive(0)
        };
        watched(gpu, &scene, &settings, 24, |_, _| {}).1
    });
    println!("{rays:?}");
    assert!(rays[1] * 2 < rays[0] + rays[0] / 10);
}
