//! Bounces that take the light of vertices.

use glam::Vec3;
use shaders::trace_types::constants as t;

use super::bounces::{by_each_way, furnace, seen};
use super::harness::{
    Gpu, Scene, bounced, encode, gpu_tests, rectangle, switch_dlight, through_byte,
};
use super::screen_hits::lit_hall;
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, LightSelection, Settings};

gpu_tests! {
    any: [
        vertices_of_a_furnace_have_all_bounces,
        vertices_keep_the_mean_of_a_hall,
        no_light_of_vertices_crosses_walls,
    ],
    compute: [
        vertices_replace_shadow_rays_and_noise,
        lights_that_change_have_rays,
        vertices_follow_the_scale_of_lights,
    ],
}

/// One bounce that takes the light of vertices.
fn cached() -> Settings {
    Settings {
        rt_bounce_cache: 16,
        ..bounced(1)
    }
}

fn vertices_of_a_furnace_have_all_bounces(gpu: &mut Gpu) {
    for albedo in [0.5, 0.8] {
        let scene = furnace(albedo, 1.0);
        let [e, a] = [0.25, albedo].map(|v| through_byte(encode(v)));
        let exact = seen(e, a, e / (1.0 - a));
        for mean in by_each_way(gpu, &scene, &cached(), 32) {
            println!("albedo {albedo}: {} {exact}", mean.x);
            assert!((mean.x / exact - 1.0).abs() < 0.012, "{mean} {exact}");
        }
    }
}

fn vertices_keep_the_mean_of_a_hall(gpu: &mut Gpu) {
    let scene = lit_hall();
    let one = gpu.mean(&scene, &bounced(1), 64).x;
    let all = gpu.mean(&scene, &bounced(12), 128).x;
    for (selection, samples) in [
        (LightSelection::Resampled, 16),
        (LightSelection::Uniform, 16),
        (LightSelection::Tree, 16),
    ] {
        let settings = Settings {
            rt_light_selection: selection,
            rt_bounce_cache: samples,
            ..cached()
        };
        let mean = gpu.mean(&scene, &settings, 64).x;
        println!("{selection:?}, {samples}: {mean}, {one} with one bounce, {all} with all");
        assert!((mean / all - 1.0).abs() < 0.01, "{mean} {all}");
        assert!(one < 0.95 * all, "{one} {all}");
    }
}

fn no_light_of_vertices_crosses_walls(gpu: &mut Gpu) {
    // two rooms on one floor and under one ceiling, with a wall of one unit between them and a lamp in the second
    let mut scene = Scene::new(
        Vec3::new(-90.0, 0.0, 5.0),
        Vec3::new(0.0, 20.0, -60.0),
        110.0,
        48,
    );
    let grey = scene.diffuse(0.8);
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), grey);
    let (y, z) = (Vec3::Y * 200.0, Vec3::Z * 200.0);
    for (x, [u, v]) in [(7.0, [z, y]), (8.0, [y, z])] {
        scene.quad(rectangle(Vec3::new(x, -100.0, -100.0), u, v), grey);
    }
    scene.point(Vec3::new(30.0, 0.0, 0.0), 50_000.0, 4.0);
    for bounces in [1, 3] {
        let settings = Settings {
            rt_bounces: bounces,
            ..cached()
        };
        let (pixels, _) = gpu.render(&scene, &settings, 8);
        for (i, pixel) in pixels.iter().enumerate() {
            assert_eq!(*pixel, Vec3::ZERO, "pixel {i}, {bounces} bounces");
        }
    }
    scene.def.view_origin = Vec3::new(90.0, 0.0, 5.0);
    let all = gpu.mean(&scene, &bounced(16), 128).x;
    // where the wall crosses a cell, a path goes on by rays
    for (bounces, error) in [(1, 0.06), (4, 0.02)] {
        let settings = Settings {
            rt_bounces: bounces,
            ..cached()
        };
        let mean = gpu.mean(&scene, &settings, 64).x;
        println!("lit side, {bounces}: {mean} {all}");
        assert!((mean / all - 1.0).abs() < error, "{mean} {all}");
    }
}

/// Mean over pixels and frames, and variance from frame to frame, relative to the mean's square.
fn noise(gpu: &mut Gpu, scene: &Scene, settings: &Settings, frames: u32) -> (f64, f64) {
    let size = (scene.def.width * scene.def.height) as usize;
    let mut sums = vec![[0.0f64; 2]; size];
    let mut add = |_, pixels: &[Vec3]| {
        for (sums, pixel) in sums.iter_mut().zip(pixels) {
            sums[0] += f64::from(pixel.x);
            sums[1] += f64::from(pixel.x).powi(2);
        }
    };
    gpu.render_watched(scene, settings, frames, |_, _| {}, Some(&mut add));
    let (frames, size) = (f64::from(frames), size as f64);
    let mean = sums.iter().map(|s| s[0] / frames).sum::<f64>() / size;
    let variance = |s: &[f64; 2]| s[1] / frames - (s[0] / frames).powi(2);
    let variance = sums.iter().map(variance).sum::<f64>() / size;
    (mean, variance / mean.powi(2))
}

/// Unfiltered frames of a game.
fn raw(settings: Settings) -> Settings {
    Settings {
        rt_accumulate: false,
        rt_taa: false,
        rt_antialiasing: false,
        rt_denoiser: DenoiserChoice::None,
        ..settings
    }
}

fn vertices_replace_shadow_rays_and_noise(gpu: &mut Gpu) {
    // lamps in sight of a point of the hall behind its pillar, which the camera does not show: all noise is of bounces
    let mut scene = Scene::hall(20.0, 0.6, 16);
    for i in 0..8 {
        let at = Vec3::new(110.0 + 10.0 * i as f32, 60.0 - 15.0 * i as f32, -40.0);
        scene.point(at, 4_000.0 + 9000.0 * i as f32, 4.0);
    }
    let mut measured = |settings: Settings| {
        gpu.count_rays(true);
        let (mean, noise) = noise(gpu, &scene, &raw(settings), 64);
        let rays = gpu.rays().expect("counted")[t::COUNT_BOUNCE_LIGHT as usize];
        gpu.count_rays(false);
        (mean, noise, rays)
    };
    let one = measured(bounced(1));
    let many = measured(bounced(16));
    let all = measured(cached());
    println!("mean, noise, shadow rays of bounces: {one:?}, 16 bounces {many:?}, vertices {all:?}");
    assert!((all.0 / many.0 - 1.0).abs() < 0.02);
    assert!(all.2 * 20 < one.2, "{all:?} {one:?}");
    assert!(all.1 < one.1, "{all:?} {one:?}");
}

fn lights_that_change_have_rays(gpu: &mut Gpu) {
    let scene = Scene::hall(40.0, 0.6, 48);
    let lamp = |frame: u32, view: &mut TracedScene| {
        switch_dlight(view, Vec3::new(0.0, -60.0, 60.0), 400.0, frame < 16);
    };
    let means = [bounced(1), cached()].map(|settings| {
        let mut means = Vec::new();
        let mut add = |_, pixels: &[Vec3]| {
            means.push(pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32);
        };
        gpu.render_watched(&scene, &raw(settings), 24, lamp, Some(&mut add));
        means
    });
    let [traced, taken] = &means;
    let mean = |means: &[f32]| means.iter().sum::<f32>() / means.len() as f32;
    let [traced, lit] = [mean(&traced[..16]), mean(&taken[..16])];
    println!("{traced} {lit}, then {:?}", &taken[16..]);
    // the same bounce by rays, and no light that outlasts its lamp
    assert!((lit / traced - 1.0).abs() < 0.01, "{lit} {traced}");
    assert!(taken[16..].iter().all(|&after| after == 0.0));
}

fn vertices_follow_the_scale_of_lights(gpu: &mut Gpu) {
    let scene = lit_hall();
    let [whole, half] = [1.0, 0.5].map(|rt_light_scale| {
        let settings = Settings {
            rt_light_scale,
            ..cached()
        };
        gpu.mean(&scene, &settings, 32).x
    });
    assert!((half / whole - 0.5).abs() < 0.005, "{half} {whole}");
}
