//! The denoiser compared with the reference.

use glam::Vec3;
use shaders::types::{Dielectric, constants as c};
use support::Aabb;

use super::harness::{
    Gpu, Scene, bounced, floor_at, gpu_tests, identity, rectangle, reference, stage, wall_at,
};
use crate::api::DynamicLight;
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, Settings};

gpu_tests! {
    any: [
        filtered_frames_come_near_the_reference,
        disoccluded_surfaces_have_no_history,
    ],
    compute: [
        light_that_is_switched_is_seen_soon,
        a_moving_light_leaves_no_trail,
        a_light_that_fades_is_followed,
        a_broken_number_does_not_spread,
        a_picture_at_rest_is_quiet,
        the_cheap_filter_comes_near_the_truth,
        both_sides_of_water_keep_their_light,
        even_light_keeps_its_level_and_color,
    ],
}

/// A room with a pillar, a lamp and a small light that throws soft and hard shadows.
fn room() -> Scene {
    let mut scene = Scene::hall(40.0, 0.6, 64);
    let lamp = Vec3::new(0.0, 60.0, 110.0);
    scene.lamp(lamp, 60.0, Vec3::splat(12.0));
    scene.point(Vec3::new(-100.0, -100.0, 0.0), 6000.0, 4.0);
    scene
}

fn live() -> Settings {
    Settings {
        rt_accumulate: false,
        rt_taa: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_bounces: 1,
        ..reference()
    }
}

/// Mean, and relative error: root mean square difference from the reference, divided by its mean.
fn compare(pixels: &[Vec3], truth: &[Vec3]) -> (f32, f32) {
    let n = truth.len() as f32;
    let mean = truth.iter().map(|p| p.x).sum::<f32>() / n;
    let square = pixels
        .iter()
        .zip(truth)
        .map(|(a, b)| (a.x - b.x).powi(2))
        .sum::<f32>()
        / n;
    (
        pixels.iter().map(|p| p.x).sum::<f32>() / n / mean,
        square.sqrt() / mean,
    )
}

fn filtered_frames_come_near_the_reference(gpu: &mut Gpu) {
    let scene = room();
    let settings = bounced(1);
    let (truth, _) = gpu.render(&scene, &settings, 400);
    // one frame without denoising
    let (raw, _) = gpu.render(&scene, &settings, 1);
    let (_, raw_error) = compare(&raw, &truth);
    let (first, _) = gpu.render(&scene, &live(), 1);
    let (first_mean, first_error) = compare(&first, &truth);
    let (settled, _) = gpu.render(&scene, &live(), 32);
    let (mean, error) = compare(&settled, &truth);
    println!(
        "error: raw {raw_error}, first frame {first_error} (mean {first_mean}), settled {error} (mean {mean})"
    );
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
    assert!(first_error < 0.6 * raw_error, "{first_error} {raw_error}");
    // the remaining error is mostly at the antialiased edges of the reference, which a frame without jitter lacks
    assert!(error < 0.25 * raw_error, "{error} {raw_error}");

    // a moving and turning camera arrives at the reference's position
    let (moved, _) = gpu.render_path(&scene, &live(), 32, |frame, def| {
        let back = 31.0 - frame as f32;
        def.view_origin = scene.def.view_origin + Vec3::new(0.7, 0.4, 0.1) * back;
        let turn = glam::Mat3::from_rotation_z(0.004 * back);
        def.view_axis = scene.def.view_axis.map(|v| turn * v);
    });
    let (mean, error) = compare(&moved, &truth);
    println!("moving: error {error}, mean {mean}");
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
    assert!(error < 0.3 * raw_error, "{error} {raw_error}");
}

fn disoccluded_surfaces_have_no_history(gpu: &mut Gpu) {
    // a moving wall covers everything: it must not show the history of surfaces behind it
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, 32);
    let white = scene.diffuse(1.0);
    let black = scene.material(&[stage::light(), stage::filter([0.0; 3])], 0);
    scene.ambient = Vec3::ONE;
    scene.quad(wall_at(300.0, 900.0), white);
    scene.quad(
        rectangle(
            Vec3::new(600.0, -900.0, 1000.0),
            Vec3::Z * 1800.0,
            Vec3::Y * 1800.0,
        ),
        black,
    );
    // the camera jumps to the other wall after ten frames
    let (pixels, _) = gpu.render_path(&scene, &live(), 11, |frame, def| {
        if frame == 10 {
            def.view_origin = Vec3::new(310.0, 0.0, 1900.0);
        }
    });
    assert!(
        pixels.iter().all(|p| *p == Vec3::ZERO),
        "{:?}",
        pixels.iter().max_by(|a, b| a.x.total_cmp(&b.x))
    );
}

/// Settings of the reference.
fn truth_settings() -> Settings {
    Settings {
        rt_bounces: 1,
        rt_antialiasing: false,
        ..reference()
    }
}

/// Means of tiles of 8 x 8 pixels of a picture of 64 x 64, red.
fn tiles(pixels: &[Vec3]) -> Vec<f32> {
    let mut sums = vec![0.0; 64];
    for (i, pixel) in pixels.iter().enumerate() {
        let (x, y) = (i % 64, i / 64);
        if let Some(sum) = sums.get_mut(x / 8 + y / 8 * 8) {
            *sum += pixel.x / 64.0;
        }
    }
    sums
}

/// Mean difference over the tiles, relative to the reference.
fn tile_error(pixels: &[Vec3], truth: &[Vec3]) -> f32 {
    let pairs = tiles(pixels).into_iter().zip(tiles(truth));
    pairs.map(|(a, b)| (a - b).abs() / b).sum::<f32>() / 64.0
}

fn lamp(origin: Vec3) -> DynamicLight {
    DynamicLight {
        origin,
        radius: 300.0,
        color: Vec3::ONE,
        ..DynamicLight::default()
    }
}

/// Frames after frame `change` until the picture stays within a tenth of the reference.
fn frames_until_true(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    [frames, change]: [u32; 2],
    place: impl Fn(u32, &mut TracedScene),
    truth: &[Vec3],
) -> u32 {
    let mut late = 0;
    let mut errors = Vec::new();
    let mut watch = |frame: u32, pixels: &[Vec3]| {
        let error = tile_error(pixels, truth);
        errors.push(error);
        if frame >= change && error > 0.1 {
            late = frame + 1 - change;
        }
    };
    gpu.render_watched(scene, settings, frames, place, Some(&mut watch));
    println!("{:.3?}", errors.get(change as usize..));
    late + 1
}

fn light_that_is_switched_is_seen_soon(gpu: &mut Gpu) {
    let scene = room();
    let lit = |view: &mut TracedScene| view.dlights = vec![lamp(Vec3::new(0.0, -60.0, 20.0))];
    let (dark_truth, _) = gpu.render(&scene, &truth_settings(), 128);
    let (lit_truth, _) = gpu.render_views(&scene, &truth_settings(), 128, |_, view| lit(view));
    let off = |frame: u32, view: &mut TracedScene| {
        if frame < 24 {
            lit(view);
        } else {
            view.dlights.clear();
        }
    };
    let on = |frame: u32, view: &mut TracedScene| {
        if frame >= 24 {
            lit(view);
        }
    };
    let adaptive = live();
    let scratch = frames_until_true(gpu, &scene, &adaptive, [24, 0], |_, _| {}, &dark_truth);
    assert_eq!(scratch, 1);
    let off_frames = frames_until_true(gpu, &scene, &adaptive, [48, 24], off, &dark_truth);
    let on_frames = frames_until_true(gpu, &scene, &adaptive, [48, 24], on, &lit_truth);
    gpu.use_gradients(false);
    let off_without = frames_until_true(gpu, &scene, &adaptive, [64, 24], off, &dark_truth);
    println!(
        "off after {off_frames} frames, on after {on_frames}, off without gradients after {off_without}"
    );
    assert!(off_frames <= 3, "{off_frames}");
    assert!(on_frames <= 3, "{on_frames}");
    assert!(off_without > 6 * off_frames, "{off_without}");
    let sparse = Settings {
        rt_denoiser: DenoiserChoice::Sparse,
        ..live()
    };
    // This filter blurs shadows more: its own settled pictures are the reference.
    let (dark, _) = gpu.render(&scene, &sparse, 48);
    let (bright, _) = gpu.render_views(&scene, &sparse, 48, |_, view| lit(view));
    let off_frames = frames_until_true(gpu, &scene, &sparse, [48, 24], off, &dark);
    let on_frames = frames_until_true(gpu, &scene, &sparse, [48, 24], on, &bright);
    println!("sparse filter: off after {off_frames} frames, on after {on_frames}");
    assert!(off_frames <= 4, "{off_frames}");
    assert!(on_frames <= 4, "{on_frames}");
}

fn a_moving_light_leaves_no_trail(gpu: &mut Gpu) {
    let scene = room();
    // from one end of the room to the other, at a rocket's speed
    let fly = |frame: u32, view: &mut TracedScene| {
        let at = Vec3::new(-60.0 + 8.0 * frame as f32, -90.0, -40.0);
        view.dlights = vec![DynamicLight {
            radius: 120.0,
            ..lamp(at)
        }];
    };
    let (truth, _) = gpu.render_views(&scene, &truth_settings(), 128, |_, view| fly(24, view));
    let (pixels, _) = gpu.render_views(&scene, &live(), 25, fly);
    gpu.use_gradients(false);
    let (without, _) = gpu.render_views(&scene, &live(), 25, fly);
    let (error, error_without) = (tile_error(&pixels, &truth), tile_error(&without, &truth));
    let (mean, _) = compare(&pixels, &truth);
    println!("moving light: error {error}, mean {mean}, without gradients {error_without}");
    assert!(error < 0.2, "{error}");
    assert!(error < 0.6 * error_without, "{error} {error_without}");
    assert!((mean - 1.0).abs() < 0.04, "{mean}");
}

fn a_light_that_fades_is_followed(gpu: &mut Gpu) {
    // by a twelfth each frame: little enough to be mistaken for noise, and after some frames far from the initial value
    let scene = room();
    let fade = |frame: u32, view: &mut TracedScene| {
        let light = lamp(Vec3::new(0.0, -60.0, 20.0));
        let left = (11.0f32 / 12.0).powf(frame as f32);
        view.dlights = vec![DynamicLight {
            color: light.color * left,
            ..light
        }];
    };
    let (truth, _) = gpu.render_views(&scene, &truth_settings(), 128, |_, view| fade(30, view));
    let (pixels, _) = gpu.render_views(&scene, &live(), 31, fade);
    gpu.use_gradients(false);
    let (without, _) = gpu.render_views(&scene, &live(), 31, fade);
    let [(mean, _), (mean_without, _)] = [&pixels, &without].map(|p| compare(p, &truth));
    println!("fading light: {mean}, without gradients {mean_without}");
    assert!((mean - 1.0).abs() < 0.06, "{mean}");
    assert!(
        mean_without - 1.0 > 0.12,
        "a test of nothing: {mean_without}"
    );
}

fn a_broken_number_does_not_spread(gpu: &mut Gpu) {
    for bad in [f32::INFINITY, f32::NAN] {
        // a lamp that exists in a single frame, with a NaN radiance
        let mut scene = room();
        let at = Vec3::new(0.0, -60.0, 60.0);
        scene.lamp(at, 40.0, Vec3::new(bad, 1.0, 1.0));
        scene.lights.last_mut().expect("added").model = 1;
        let instance = scene.instances.len() as u32;
        scene.instances.push(identity());
        let lamp = crate::scene::Submodel { model: 1, instance };
        let with_lamp = |at: u32| {
            move |frame: u32, view: &mut TracedScene| {
                view.look.submodels.clear();
                if frame == at {
                    view.look.submodels.push(lamp);
                }
            }
        };
        for settings in [
            live(),
            Settings {
                rt_taa: true,
                ..live()
            },
            Settings {
                rt_denoiser: DenoiserChoice::Sparse,
                ..live()
            },
        ] {
            let (sound, _) = gpu.render_views(&scene, &settings, 40, with_lamp(1000));
            let brightest = sound.iter().map(|p| p.max_element()).fold(0.0, f32::max);
            let mut worst = 0.0f32;
            let mut watch = |_: u32, pixels: &[Vec3]| {
                for p in pixels {
                    assert!(p.is_finite(), "{p}");
                    worst = worst.max(p.max_element());
                }
            };
            let (after, _) =
                gpu.render_watched(&scene, &settings, 40, with_lamp(24), Some(&mut watch));
            let (mean, error) = compare(&after, &sound);
            println!("{bad}: brightest {brightest}, at worst {worst}; after it {mean}, {error}");
            assert!(worst < 3.0 * brightest, "{worst} {brightest}");
            assert!((mean - 1.0).abs() < 0.05 && error < 0.2, "{mean} {error}");
        }
    }
}

fn a_picture_at_rest_is_quiet(gpu: &mut Gpu) {
    let scene = room();
    let (truth, _) = gpu.render(&scene, &truth_settings(), 256);
    let mut sums = vec![(0.0f32, 0.0f32); truth.len()];
    let mut watch = |frame: u32, pixels: &[Vec3]| {
        if frame >= 32 {
            for (sum, pixel) in sums.iter_mut().zip(pixels) {
                sum.0 += pixel.x;
                sum.1 += pixel.x * pixel.x;
            }
        }
    };
    gpu.render_watched(&scene, &live(), 64, |_, _| {}, Some(&mut watch));
    let mut noise: Vec<f32> = sums
        .iter()
        .map(|(sum, squares)| {
            let (mean, square) = (sum / 32.0, squares / 32.0);
            (square - mean * mean).max(0.0).sqrt() / mean
        })
        .collect();
    noise.sort_by(f32::total_cmp);
    let median = noise.get(noise.len() / 2).copied().unwrap_or(1.0);
    let mean =
        sums.iter().map(|s| s.0 / 32.0).sum::<f32>() / truth.iter().map(|p| p.x).sum::<f32>();
    let means: Vec<Vec3> = sums.iter().map(|s| Vec3::splat(s.0 / 32.0)).collect();
    let error = tile_error(&means, &truth);
    println!("at rest: median noise {median}, mean {mean}, error of tiles {error}");
    assert!(median < 0.02, "{median}");
    assert!((mean - 1.0).abs() < 0.015, "{mean}");
    assert!(error < 0.05, "{error}");
}

fn the_cheap_filter_comes_near_the_truth(gpu: &mut Gpu) {
    let scene = room();
    let sparse = Settings {
        rt_denoiser: DenoiserChoice::Sparse,
        ..live()
    };
    let none = Settings {
        rt_denoiser: DenoiserChoice::None,
        ..live()
    };
    let (truth, _) = gpu.render(&scene, &truth_settings(), 256);
    let (raw, _) = gpu.render(&scene, &none, 1);
    let (first, _) = gpu.render(&scene, &sparse, 1);
    let (settled, _) = gpu.render(&scene, &sparse, 32);
    let (raw, first, settled) = (
        compare(&raw, &truth),
        compare(&first, &truth),
        compare(&settled, &truth),
    );
    println!("sparse filter, mean and error: raw {raw:?}, first {first:?}, settled {settled:?}");
    assert!((settled.0 - 1.0).abs() < 0.03, "{settled:?}");
    assert!(first.1 < 0.6 * raw.1, "{first:?} {raw:?}");
    assert!(settled.1 < 0.5 * raw.1, "{settled:?} {raw:?}");
}

/// A wall that stands in water, lit above the surface and dark below: reflection and refraction are adjacent in the
/// picture, at equal view distances and normals, and differ only in their light.
fn both_sides_of_water_keep_their_light(gpu: &mut Gpu) {
    let mut scene = Scene::new(
        Vec3::new(-60.0, 0.0, 40.0),
        Vec3::new(100.0, 0.0, -20.0),
        40.0,
        64,
    );
    let grey = scene.diffuse(0.6);
    let water = scene.material(
        &[stage::filter([1.0; 3])],
        c::MATERIAL_LIQUID | c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
    );
    // transparent, but lamps do not shine through it
    scene.materials[water as usize].0.dielectric = Dielectric {
        index: 1.33,
        scale: 1.0,
        filters: 1,
        ..Dielectric::default()
    };
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), grey);
    let surface = floor_at(0.0, 100.0);
    scene.quad(surface, water);
    scene.filters.push(Aabb::new(
        Vec3::new(-100.0, -100.0, -1.0),
        Vec3::new(100.0, 100.0, 1.0),
    ));
    let lamp = Vec3::new(0.0, -30.0, 95.0);
    scene.lamp(lamp, 60.0, Vec3::splat(12.0));
    // direct and bounced light each go their own way through the denoiser
    for (bounces, denoiser) in [
        (0, DenoiserChoice::ASvgf),
        (1, DenoiserChoice::ASvgf),
        (0, DenoiserChoice::Sparse),
    ] {
        let with = |settings: Settings| Settings {
            rt_bounces: bounces,
            ..settings
        };
        let filtered = Settings {
            rt_denoiser: denoiser,
            ..live()
        };
        let (truth, _) = gpu.render(&scene, &with(truth_settings()), 256);
        let (settled, _) = gpu.render(&scene, &with(filtered), 32);
        let water = 24 * 64..60 * 64;
        let (mean, error) = compare(&settled[water.clone()], &truth[water]);
        println!("water, {bounces} bounces, filter {denoiser:?}: mean {mean}, error {error}");
        assert!((mean - 1.0).abs() < 0.04, "{bounces}, {denoiser:?}: {mean}");
        assert!(error < 0.15, "{bounces}, {denoiser:?}: {error}");
    }
}

/// Uniform light is unchanged by the filter over many frames, for any colour, dim or bright.
fn even_light_keeps_its_level_and_color(gpu: &mut Gpu) {
    let colors = [[1.0, 0.3, 0.05], [0.0, 1.0, 0.0], [0.02, 0.1, 1.0]].map(Vec3::from);
    for light in [1.0e-3, 1.0, 1.0e3].map(|level| colors.map(|color| color * level)) {
        for light in light {
            let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, 32);
            let white = scene.diffuse(1.0);
            scene.ambient = light;
            let wall = Vec3::new(300.0, -900.0, -900.0);
            scene.quad(rectangle(wall, Vec3::Z * 1800.0, Vec3::Y * 1800.0), white);
            let (pixels, _) = gpu.render(&scene, &live(), 16);
            let mean = pixels.iter().sum::<Vec3>() / pixels.len() as f32;
            let most = light.max_element();
            let off = (mean - light).abs().max_element() / most;
            let worst = pixels
                .iter()
                .map(|p| (*p - light).abs().max_element() / most)
                .fold(0.0, f32::max);
            println!("{light}: mean off by {off}, worst pixel by {worst}");
            assert!(off < 0.003, "{light}: {mean}");
            assert!(worst < 0.02, "{light}: {worst}");
        }
    }
}
