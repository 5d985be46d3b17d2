//! Light samples reused over pixels and frames: their mean is that of all lights, shadows included, and their error is
//! smaller.

use glam::Vec3;

use super::harness::{Gpu, Scene, floor_at, floor_points, gpu_tests, lambert, rectangle};
use super::lights::{SIDE, all_lights, cloud, crowd};
use crate::settings::{DebugOutput, DenoiserChoice, LightSelection, Settings};

gpu_tests! {
    any: [
        reused_samples_have_the_mean_of_all_lights,
        a_shadow_of_reused_samples_is_black,
        reused_samples_have_smaller_errors,
        the_denoiser_filters_reused_samples_without_gradients,
        moving_lights_leave_no_samples_behind,
    ],
    each: [
        one_light_gives_the_closed_form_by_reused_samples,
    ],
}

/// As reference mode: samples of neighbours.
fn of_neighbours() -> Settings {
    Settings {
        rt_light_selection: LightSelection::Reused,
        rt_num_random_dl: 1,
        ..all_lights()
    }
}

/// As a game shows it, without filters: samples of neighbours and of the last frame.
fn live() -> Settings {
    Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::None,
        rt_taa: false,
        ..of_neighbours()
    }
}

/// Mean over `runs` independent runs of four frames; `place` offsets the camera in each frame. Reuse correlates successive
/// frames, so that the mean of one long run would converge slowly.
fn mean_of_runs(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    runs: u32,
    place: impl Fn(u32) -> Vec3,
) -> Vec<Vec3> {
    let mut sum = vec![Vec3::ZERO; SIDE * SIDE];
    let mut add = |_, pixels: &[Vec3]| {
        for (sum, pixel) in sum.iter_mut().zip(pixels) {
            *sum += *pixel / (4 * runs) as f32;
        }
    };
    let origin = scene.def.view_origin;
    for _ in 0..runs {
        gpu.render_watched(
            scene,
            settings,
            4,
            |frame, view| view.def.view_origin = origin + place(frame),
            Some(&mut add),
        );
    }
    sum
}

/// Ratio of the means of two pictures, and the largest relative difference of one of 16 tiles.
fn ratios(pixels: &[Vec3], truth: &[Vec3]) -> (f32, f32) {
    let ratio = |chosen: &dyn Fn(usize) -> bool| {
        let pairs = pixels.iter().zip(truth).enumerate();
        let (a, b) = pairs
            .filter(|(i, _)| chosen(*i))
            .fold((0.0, 0.0), |(a, b), (_, (p, t))| (a + p.x, b + t.x));
        a / b
    };
    let tiles = (0..16).map(|tile| {
        let part = ratio(&|i| i % SIDE / 8 == tile % 4 && i / SIDE / 8 == tile / 4);
        (part - 1.0).abs()
    });
    (ratio(&|_| true), tiles.fold(0.0, f32::max))
}

fn reused_samples_have_the_mean_of_all_lights(gpu: &mut Gpu) {
    for (name, scene) in [("crowd", crowd()), ("cloud", cloud())] {
        let (truth, _) = gpu.render(&scene, &all_lights(), 48);
        let (spatial, _) = gpu.render(&scene, &of_neighbours(), 384);
        let still = |_| Vec3::ZERO;
        let lasting = mean_of_runs(gpu, &scene, &live(), 320, still);
        for (what, pixels) in [("neighbours", &spatial), ("frames, too", &lasting)] {
            let (whole, worst) = ratios(pixels, &truth);
            println!("{name}, {what}: {whole}, worst tile {worst}");
            assert!((whole - 1.0).abs() < 0.005, "{name}, {what}: {whole}");
            assert!(worst < 0.02, "{name}, {what}: {worst}");
        }
        // a camera that goes back and forth: the surfaces of the last frame are others
        let place = |frame: u32| Vec3::Y * [0.0, 6.0, 12.0, 6.0][frame as usize % 4];
        let resampled = Settings {
            rt_light_selection: LightSelection::Resampled,
            ..live()
        };
        let truth = mean_of_runs(gpu, &scene, &resampled, 192, place);
        let moved = mean_of_runs(gpu, &scene, &live(), 320, place);
        let (whole, worst) = ratios(&moved, &truth);
        println!("{name}, moving camera: {whole}, worst tile {worst}");
        assert!((whole - 1.0).abs() < 0.006, "{name}, moving: {whole}");
        assert!(worst < 0.03, "{name}, moving: {worst}");
    }
}

fn one_light_gives_the_closed_form_by_reused_samples(gpu: &mut Gpu) {
    let triangle = [
        Vec3::new(-40.0, -30.0, 60.0),
        Vec3::new(0.0, 50.0, 60.0),
        Vec3::new(50.0, -40.0, 70.0),
    ];
    let mut scene = Scene::new(Vec3::Z * 50.0, Vec3::ZERO, 80.0, SIDE as i32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 500.0), white);
    scene.light(triangle, Vec3::splat(5.0));
    let exact: Vec<Vec3> = floor_points(&scene)
        .map(|p| Vec3::splat(lambert(p, Vec3::Z, triangle, 5.0)))
        .collect();
    let (spatial, _) = gpu.render(&scene, &of_neighbours(), 64);
    let lasting = mean_of_runs(gpu, &scene, &live(), 64, |_| Vec3::ZERO);
    for pixels in [spatial, lasting] {
        let (whole, worst) = ratios(&pixels, &exact);
        println!("{whole}, worst tile {worst}");
        assert!((whole - 1.0).abs() < 0.002, "{whole}");
        assert!(worst < 0.005, "{worst}");
    }
}

fn a_shadow_of_reused_samples_is_black(gpu: &mut Gpu) {
    // lit and shadowed pixels are neighbours: none takes over light that does not arrive, and none loses light to
    // neighbours that could not have found it
    let mut scene = Scene::new(Vec3::Z * 90.0, Vec3::ZERO, 80.0, SIDE as i32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 900.0), white);
    let corner = Vec3::new(-900.0, -900.0, 150.0);
    scene.quad(rectangle(corner, Vec3::Y * 1800.0, Vec3::X * 900.0), white);
    let triangle = [
        Vec3::new(-2.0, -2.0, 300.0),
        Vec3::new(0.0, 2.0, 300.0),
        Vec3::new(2.0, -2.0, 300.0),
    ];
    scene.light(triangle, Vec3::splat(2000.0));
    // lights of the lit side alone, so that neighbours disagree about the best
    for y in [-30.0, 30.0] {
        scene.lamp(Vec3::new(8.0, y, 300.0), 2.0, Vec3::splat(2000.0));
    }
    let (truth, _) = gpu.render(&scene, &all_lights(), 32);
    let (spatial, _) = gpu.render(&scene, &of_neighbours(), 128);
    let lasting = mean_of_runs(gpu, &scene, &live(), 128, |_| Vec3::ZERO);
    let mut black = 0;
    for (i, truth) in truth.iter().enumerate() {
        if truth.x == 0.0 {
            black += 1;
            assert_eq!((spatial[i], lasting[i]), (Vec3::ZERO, Vec3::ZERO), "{i}");
        }
    }
    println!("{black} pixels in shadow");
    assert!(black > 100, "{black}");
    let lit = |pixels: &[Vec3]| {
        let columns = pixels.iter().zip(&truth).filter(|(_, t)| t.x > 0.0);
        columns.map(|(p, t)| p.x / t.x).sum::<f32>() / (SIDE * SIDE - black) as f32
    };
    println!("lit: {} {}", lit(&spatial), lit(&lasting));
    assert!((lit(&spatial) - 1.0).abs() < 0.01, "{}", lit(&spatial));
    assert!((lit(&lasting) - 1.0).abs() < 0.01, "{}", lit(&lasting));
}

fn reused_samples_have_smaller_errors(gpu: &mut Gpu) {
    let mut scene = crowd();
    // samples of dynamic lights do not last
    scene.dlights.clear();
    let (truth, _) = gpu.render(&scene, &all_lights(), 64);
    let resampled = Settings {
        rt_light_selection: LightSelection::Resampled,
        ..live()
    };
    let mut errors = |settings: &Settings| {
        let mut sum = 0.0f32;
        let mut add = |frame, pixels: &[Vec3]| {
            if frame >= 24 {
                let squares = pixels.iter().zip(&truth).map(|(a, b)| (a.x - b.x).powi(2));
                sum += squares.sum::<f32>();
            }
        };
        gpu.render_watched(&scene, settings, 40, |_, _| {}, Some(&mut add));
        sum
    };
    let (alone, reused) = (errors(&resampled), errors(&live()));
    println!("squared errors: {alone} alone, {reused} with reuse");
    assert!(reused < 0.6 * alone, "{alone} {reused}");
}

fn the_denoiser_filters_reused_samples_without_gradients(gpu: &mut Gpu) {
    let scene = cloud();
    let truth = gpu.mean(&scene, &all_lights(), 32).x;
    let denoised = Settings {
        rt_denoiser: DenoiserChoice::ASvgf,
        ..live()
    };
    // a frame repeats no sample of the last one, so gradients stay black
    let mut shown = |selection| {
        let settings = Settings {
            rt_light_selection: selection,
            rt_debug: DebugOutput::Gradients,
            ..denoised.clone()
        };
        let change = |frame: u32, view: &mut crate::scene::TracedScene| {
            // a light goes out
            if frame == 4 {
                view.dlights.clear();
            }
        };
        let mut lit = cloud();
        lit.dlight(Vec3::new(20.0, 0.0, 20.0), 300.0, 1.0);
        let (_, picture) = gpu.render_views(&lit, &settings, 5, change);
        let bright = |p: &&[u8; 4]| p[..3].iter().any(|&c| c > 32);
        picture.iter().filter(bright).count()
    };
    let (alone, reused) = (
        shown(LightSelection::Resampled),
        shown(LightSelection::Reused),
    );
    println!("{alone} pixels with a gradient, {reused} with reuse");
    assert!(alone > 100 && reused == 0, "{alone} {reused}");
    let (mut sum, frames) = (0.0, 64);
    let mut add = |_, pixels: &[Vec3]| {
        sum += pixels.iter().map(|p| p.x).sum::<f32>() / (frames as usize * pixels.len()) as f32;
    };
    gpu.render_watched(&scene, &denoised, frames, |_, _| {}, Some(&mut add));
    println!("{} of all lights", sum / truth);
    assert!((sum / truth - 1.0).abs() < 0.05, "{sum} {truth}");
}

fn moving_lights_leave_no_samples_behind(gpu: &mut Gpu) {
    // the number of a dynamic light belongs to another light in each frame
    let mut scene = Scene::new(Vec3::Z * 90.0, Vec3::ZERO, 60.0, SIDE as i32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 900.0), white);
    for x in [-40.0, 0.0, 40.0] {
        scene.dlight(Vec3::new(x, 0.0, 60.0), 60.0 + x, 1.0);
    }
    let mean = |gpu: &mut Gpu, settings: &Settings| {
        let mut sum = vec![Vec3::ZERO; SIDE * SIDE];
        let mut add = |_, pixels: &[Vec3]| {
            for (sum, pixel) in sum.iter_mut().zip(pixels) {
                *sum += *pixel;
            }
        };
        let turn = |frame: u32, view: &mut crate::scene::TracedScene| {
            let count = view.dlights.len();
            view.dlights.rotate_left(frame as usize % count);
        };
        gpu.render_watched(&scene, settings, 256, turn, Some(&mut add));
        sum
    };
    let all = Settings {
        rt_num_random_dl: 0,
        ..live()
    };
    let (truth, reused) = (mean(gpu, &all), mean(gpu, &live()));
    let (whole, worst) = ratios(&reused, &truth);
    println!("{whole}, worst tile {worst}");
    assert!((whole - 1.0).abs() < 0.005, "{whole}");
    assert!(worst < 0.02, "{worst}");
}
