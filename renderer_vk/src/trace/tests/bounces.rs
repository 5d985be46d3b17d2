//! Bounced light: partial sums of a furnace, colour bleeding, walls that stop light from outside.

use std::f32::consts::PI;
use std::iter::successors;

use glam::Vec3;
use shaders::types::{Dielectric, constants as c};
use support::Aabb;

use super::dielectrics::square;
use super::harness::{
    Gpu, Scene, bounced, encode, floor_at, floor_points, gpu_tests, lambert, rectangle, stage,
    through_byte,
};
use super::screen_hits::on_screen;
use crate::settings::{DenoiserChoice, LightSelection, MOST_BOUNCES, Settings};
use crate::trace::frame_lights::decode;

gpu_tests! {
    any: [
        a_furnace_sums_its_bounces,
        lightmap_brightness_scales_reflectance,
        gloss_throws_back_what_its_picture_shows,
        a_red_wall_colours_the_floor,
        a_bounce_has_one_ray_for_lamps_and_sun,
        bounced_light_passes_fog,
        samples_of_a_frame_divide_its_noise,
    ],
    each: [
        no_light_leaks_through_walls,
        bounced_light_passes_tinted_glass,
    ],
}

/// The mean of a picture with one bounce: in reference mode, and in that of a game, which has passes of its own for it.
pub(super) fn by_each_way(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    frames: u32,
) -> [Vec3; 2] {
    let live = Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_taa: false,
        ..settings.clone()
    };
    let mut sum = Vec3::ZERO;
    let mut add = |_, pixels: &[Vec3]| {
        sum += pixels.iter().sum::<Vec3>() / pixels.len() as f32;
    };
    gpu.render_watched(scene, &live, frames, |_, _| {}, Some(&mut add));
    [gpu.mean(scene, settings, frames), sum / frames as f32]
}

/// Displayed radiance of an emissive, lit wall: both parts are summed in display values under the light that the engine
/// shows, here that of white vertices, and share the light of the sum.
pub(super) fn seen(glow: f32, albedo: f32, light: f32) -> f32 {
    let slope = |displayed: f32| {
        let bounded = displayed.clamp(1.0e-4, 1.0);
        decode(Vec3::splat(bounded)).x / bounded
    };
    let [own_glow, own_lit] = [glow, albedo].map(encode);
    let whole = slope(own_glow + own_lit);
    whole * (glow / slope(own_glow) + albedo * light / slope(own_lit))
}

/// A room whose walls glow with 0.25 and reflect `albedo`; their stored light is scaled by `scale`.
pub(super) fn furnace(albedo: f32, scale: f32) -> Scene {
    let camera = Vec3::new(-20.0, 10.0, 5.0);
    let mut scene = Scene::new(camera, Vec3::new(50.0, 20.0, -30.0), 90.0, 32);
    let glow = stage::add([encode(0.25); 3]);
    let stages = [stage::light(), stage::filter([encode(albedo); 3]), glow];
    let wall = scene.material(&stages, 0);
    scene.materials[wall as usize].0.lit_scale = scale;
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), wall);
    scene
}

/// A white floor before a wall of some color (encoded) at x = 0 that faces -x, and the wall's corners.
pub(super) fn floor_before_a_wall(color: [f32; 3]) -> (Scene, [Vec3; 4]) {
    let camera = Vec3::new(-60.0, 0.0, 40.0);
    let mut scene = Scene::new(camera, Vec3::new(-40.0, 0.0, 0.0), 4.0, 32);
    let white = scene.diffuse(1.0);
    let painted = scene.material(&[stage::light(), stage::filter(color)], 0);
    scene.quad(floor_at(0.0, 500.0), white);
    let wall = rectangle(Vec3::new(0.0, -40.0, 0.0), Vec3::Z * 50.0, Vec3::Y * 80.0);
    scene.quad(wall, painted);
    (scene, wall)
}

/// [`lambert`] of a quad, for a point that faces up.
pub(super) fn lambert_of_quad(point: Vec3, [a, b, c, d]: [Vec3; 4], radiance: f32) -> f32 {
    [[a, b, c], [a, c, d]]
        .map(|triangle| lambert(point, Vec3::Z, triangle, radiance))
        .iter()
        .sum()
}

fn a_furnace_sums_its_bounces(gpu: &mut Gpu) {
    // every wall emits e and reflects a: after n bounces it shows e (1 + a + ... + a^n). Of the three albedos, one is
    // below the minimum survival probability, one above, and one terminates no path
    for albedo in [0.1, 0.5, 1.0] {
        let scene = furnace(albedo, 1.0);
        let [e, a] = [0.25, albedo].map(|v| through_byte(encode(v)));
        // light that arrives at a wall
        let light_of = |bounces: u32| -> f32 {
            successors(Some(e), |power| Some(power * a))
                .take(bounces as usize)
                .sum()
        };
        for bounces in [0, 1, 2, 5, MOST_BOUNCES] {
            let exact = seen(e, a, light_of(bounces));
            let mean = gpu.mean(&scene, &bounced(bounces), 16).x;
            println!("albedo {albedo}, {bounces}: {mean} {exact}");
            assert!(
                (mean / exact - 1.0).abs() < 0.003,
                "albedo {albedo}, {bounces} bounces: {mean} {exact}"
            );
        }
        // of a game's frames a quarter of the pixels gathers, and the roulette makes long paths noisy
        for (bounces, samples, frames, error) in
            [(1, 1, 16, 0.003), (4, 1, 64, 0.008), (4, 3, 64, 0.006)]
        {
            let exact = seen(e, a, light_of(bounces));
            let settings = Settings {
                rt_samples: samples,
                ..bounced(bounces)
            };
            let [_, live] = by_each_way(gpu, &scene, &settings, frames);
            println!("albedo {albedo}, {bounces}, as a game shows it: {live} {exact}");
            assert!((live.x / exact - 1.0).abs() < error, "{live} {exact}");
        }
    }
}

fn lightmap_brightness_scales_reflectance(gpu: &mut Gpu) {
    // the furnace with an albedo of one half: the reflected light is scaled, to at most all of it; emission is not
    for (scale, part) in [(1.0, 0.5), (0.25, 0.125), (64.0, 1.0)] {
        let scene = furnace(0.5, scale);
        let glow = through_byte(encode(0.25));
        let exact = seen(glow, part, glow);
        let mean = gpu.mean(&scene, &bounced(1), 16).x;
        println!("{scale}: {mean} {exact}");
        assert!((mean / exact - 1.0).abs() < 0.01, "{scale}: {mean} {exact}");
    }
}

fn gloss_throws_back_what_its_picture_shows(gpu: &mut Gpu) {
    // a small white patch in a furnace with glossy walls: it receives their emission g and, with a second bounce, g a from
    // all around and g a by reflection, where a is the mean of their image
    let texels: Vec<u8> = [40u8, 216].iter().flat_map(|&v| [v, v, v, 255]).collect();
    let texels = [texels.clone(), texels].concat();
    let picture = square(gpu, 2, &texels);
    let camera = Vec3::new(0.0, 0.0, 8.0);
    let mut scene = Scene::new(camera, Vec3::new(0.1, 0.0, 0.0), 12.0, 16);
    scene.images.push(picture.texture_index());
    let stages = [
        stage::constant([0.0; 3]),
        stage::gloss(0),
        stage::light_over(),
        stage::add([encode(0.25); 3]),
    ];
    let wall = scene.material(&stages, 0);
    let (mins, maxs) = (Vec3::new(-100.0, -100.0, -2.0), Vec3::splat(100.0));
    scene.room(mins, maxs, wall);
    let white = scene.material(&[stage::light()], 0);
    let corner = Vec3::new(-2.0, -2.0, 0.0);
    scene.quad(rectangle(corner, Vec3::X * 4.0, Vec3::Y * 4.0), white);
    let glow = through_byte(encode(0.25));
    let mut once = 0.0;
    for (bounces, exact) in [
        (1, glow),
        (2, glow * (1.0 + 2.0 * decode(Vec3::splat(128.0 / 255.0)).x)),
    ] {
        let mean = gpu.mean(&scene, &bounced(bounces), 64).x;
        println!("{bounces}: {mean} {exact}");
        assert!(
            (mean / exact - 1.0).abs() < 0.01,
            "{bounces}: {mean} {exact}"
        );
        assert!(mean > 1.1 * once, "a test of nothing");
        once = mean;
    }
}

fn a_red_wall_colours_the_floor(gpu: &mut Gpu) {
    let color = [encode(0.6), encode(0.2), encode(0.05)];
    let (mut scene, wall) = floor_before_a_wall(color);
    // shines along the floor on the wall alone
    scene.sun(-Vec3::X, 3.0, 1.0e-5);
    let (pixels, _) = gpu.render(&scene, &bounced(1), 256);
    let truth: f32 = floor_points(&scene)
        .map(|p| lambert_of_quad(p, wall, 3.0 / PI))
        .sum();
    let sum = pixels.iter().sum::<Vec3>();
    for (channel, code) in color.into_iter().enumerate() {
        let ratio = sum[channel] / (truth * through_byte(code));
        println!("channel {channel}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.015, "channel {channel}: {ratio}");
    }
}

fn a_bounce_has_one_ray_for_lamps_and_sun(gpu: &mut Gpu) {
    // points lit by the sun only, by lamps only, and by both: a sunlit floor, part of it under a roof with lamps
    let mut scene = Scene::new(
        Vec3::new(-150.0, 0.0, 40.0),
        Vec3::new(0.0, 0.0, 10.0),
        80.0,
        32,
    );
    let grey = scene.diffuse(0.7);
    let floor = Vec3::new(-200.0, -200.0, 0.0);
    scene.quad(rectangle(floor, Vec3::X * 400.0, Vec3::Y * 400.0), grey);
    let roof = Vec3::new(0.0, -100.0, 80.0);
    scene.quad(rectangle(roof, Vec3::Y * 200.0, Vec3::X * 150.0), grey);
    let wall = Vec3::new(150.0, -100.0, 0.0);
    scene.quad(rectangle(wall, Vec3::Z * 80.0, Vec3::Y * 200.0), grey);
    for y in [-60.0, 0.0, 60.0] {
        scene.point(Vec3::new(60.0, y, 60.0), 3000.0 + 10.0 * y, 4.0);
    }
    scene.sun(Vec3::new(-0.5, 0.2, 0.8).normalize(), 4.0, 0.02);
    let [uniform, resampled, tree] = [
        LightSelection::Uniform,
        LightSelection::Resampled,
        LightSelection::Tree,
    ]
    .map(|selection| {
        let settings = Settings {
            rt_light_selection: selection,
            ..bounced(1)
        };
        let direct = Settings {
            rt_bounces: 0,
            ..settings.clone()
        };
        gpu.mean(&scene, &settings, 256).x - gpu.mean(&scene, &direct, 256).x
    });
    println!("{tree} from a tree");
    assert!((tree / uniform - 1.0).abs() < 0.03, "{uniform} {tree}");
    let [reference, live] = by_each_way(gpu, &scene, &bounced(1), 256);
    println!("as a game shows it: {}", live.x / reference.x);
    assert!((live.x / reference.x - 1.0).abs() < 0.02);
    println!("bounced: {uniform} with one of all, {resampled} with the better choice");
    assert!(uniform > 0.01, "{uniform}");
    assert!(
        (resampled / uniform - 1.0).abs() < 0.03,
        "{uniform} {resampled}"
    );
}

fn no_light_leaks_through_walls(gpu: &mut Gpu) {
    // a bright room and a dark one, separated by a wall of one unit, with the sun outside of both
    for culling in [0, c::MATERIAL_TWO_SIDED] {
        let mut scene = Scene::new(
            Vec3::new(-90.0, 0.0, 5.0),
            Vec3::new(0.0, 20.0, -30.0),
            100.0,
            32,
        );
        let grey = scene.diffuse(0.8);
        scene.room(Vec3::splat(-100.0), Vec3::new(0.0, 100.0, 100.0), grey);
        let sheet = scene.material(&[stage::light(), stage::filter([0.8; 3])], culling);
        scene.room(Vec3::new(1.0, -100.0, -100.0), Vec3::splat(100.0), sheet);
        scene.point(Vec3::new(30.0, 0.0, 0.0), 50_000.0, 4.0);
        scene.sun(Vec3::new(-0.4, 0.3, 0.6).normalize(), 5.0, 0.01);
        for selection in [LightSelection::Uniform, LightSelection::Resampled] {
            let settings = Settings {
                rt_light_selection: selection,
                ..bounced(MOST_BOUNCES)
            };
            let (pixels, _) = gpu.render(&scene, &settings, 8);
            for (i, pixel) in pixels.iter().enumerate() {
                assert_eq!(
                    *pixel,
                    Vec3::ZERO,
                    "pixel {i}, {selection:?}, cull {culling}"
                );
            }
        }
        // nor by the picture of the last frame, be it that of the bright room
        for frames in [[0, 8], [4, 4], [4, 1]] {
            let [bright, dark] = frames;
            let origin = scene.def.view_origin;
            let (pixels, _) =
                gpu.render_path(&scene, &on_screen(1), bright + dark, |frame, def| {
                    let x = if frame < bright { 90.0 } else { -90.0 };
                    def.view_origin = Vec3::new(x, origin.y, origin.z);
                });
            for (i, pixel) in pixels.iter().enumerate() {
                assert_eq!(*pixel, Vec3::ZERO, "pixel {i}, {frames:?}, cull {culling}");
            }
        }
        // the lamp lights its own side
        scene.def.view_origin = Vec3::new(90.0, 0.0, 5.0);
        assert!(gpu.mean(&scene, &bounced(0), 4).min_element() > 0.1);
    }
}

fn bounced_light_passes_fog(gpu: &mut Gpu) {
    // below a slab of fog under a glowing ceiling, all infinite: from the direction at the angle t to the normal the
    // floor receives fog * f + glow * (1 - f), f = sqrt(thickness / cos t / depth), weighted by 2 cos t sin t
    let (glow, tint) = (0.8, Vec3::new(0.1, 0.5, 0.2));
    let mut scene = Scene::new(Vec3::Z * 20.0, Vec3::new(0.1, 0.0, 0.0), 20.0, 32);
    let ceiling = scene.material(&[stage::constant([encode(glow); 3])], 0);
    let floor = scene.material(&[stage::light()], 0);
    let (x, y) = (Vec3::X * 80_000.0, Vec3::Y * 80_000.0);
    let corner = Vec3::new(-40_000.0, -40_000.0, 0.0);
    scene.quad(rectangle(corner, x, y), floor);
    scene.quad(rectangle(corner + Vec3::Z * 200.0, y, x), ceiling);
    let exact_without = through_byte(encode(glow));
    let without = gpu.mean(&scene, &bounced(1), 16);
    assert!((without.y / exact_without - 1.0).abs() < 0.01, "{without}");
    let (thickness, depth) = (40.0, 160.0);
    scene.fogs.push(shaders::types::Fog {
        mins: Vec3::new(-1.0e5, -1.0e5, 100.0),
        maxs: Vec3::new(1.0e5, 1.0e5, 100.0 + thickness),
        plane: [0.0; 4],
        has_surface: 0,
        color: tint,
        depth,
        own_light: Vec3::ZERO,
    });
    let steps = 10_000;
    let factor: f32 = (0..steps)
        .map(|i| {
            // uniform steps of the squared sine are uniform in 2 cos t sin t dt
            let cosine = (1.0 - (i as f32 + 0.5) / steps as f32).sqrt();
            (thickness / cosine / depth).sqrt().min(1.0) / steps as f32
        })
        .sum();
    let exact = decode(tint) * factor + exact_without * (1.0 - factor);
    for mean in by_each_way(gpu, &scene, &bounced(1), 64) {
        println!("{mean} {exact}");
        assert!(
            (mean / exact - 1.0).abs().max_element() < 0.01,
            "{mean} {exact}"
        );
    }
}

fn bounced_light_passes_tinted_glass(gpu: &mut Gpu) {
    // a white floor under a glowing ceiling, both infinite, with tinted glass between them
    let (glow, tint) = (0.8, Vec3::new(0.9, 0.2, 0.1));
    let mut scene = Scene::new(Vec3::Z * 20.0, Vec3::new(0.1, 0.0, 0.0), 20.0, 32);
    let ceiling = scene.material(&[stage::constant([encode(glow); 3])], 0);
    let floor = scene.material(&[stage::light()], 0);
    let glass = scene.material(
        &[stage::filter([1.0; 3])],
        c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
    );
    scene.materials[glass as usize].0.dielectric = Dielectric {
        filters: 1,
        filter_color: tint,
        ..Dielectric::default()
    };
    let (x, y) = (Vec3::X * 80_000.0, Vec3::Y * 80_000.0);
    let corner = Vec3::new(-40_000.0, -40_000.0, 0.0);
    scene.quad(rectangle(corner, x, y), floor);
    scene.quad(rectangle(corner + Vec3::Z * 100.0, y, x), glass);
    scene.quad(rectangle(corner + Vec3::Z * 200.0, y, x), ceiling);
    let pane = [corner, corner + x + y].map(|p| p + Vec3::Z * 100.0);
    scene.filters.push(Aabb::of(pane).grown(Vec3::Z));
    let exact = through_byte(encode(glow)) * tint;
    for mean in by_each_way(gpu, &scene, &bounced(1), 16) {
        println!("{mean} {exact}");
        assert!(
            (mean / exact - 1.0).abs().max_element() < 0.01,
            "{mean} {exact}"
        );
    }
}

fn samples_of_a_frame_divide_its_noise(gpu: &mut Gpu) {
    const FRAMES: u32 = 64;
    // lit by a lamp behind a wall alone, so that all light is bounced; and by lamps in sight
    for (hidden, bounces) in [(true, 2), (false, 0)] {
        let mut scene = Scene::hall(20.0, 0.6, 16);
        if hidden {
            scene.point(Vec3::new(100.0, 60.0, -40.0), 60_000.0, 4.0);
        } else {
            for i in 0..20 {
                let at = Vec3::new(-100.0 + 15.0 * i as f32, 40.0, 60.0);
                scene.point(at, 1000.0 + 300.0 * i as f32, 4.0);
            }
        }
        // mean, and variance from frame to frame
        let mut measured = |lights: u32, samples: u32| {
            let settings = Settings {
                rt_accumulate: false,
                rt_denoiser: DenoiserChoice::None,
                rt_taa: false,
                rt_antialiasing: false,
                rt_num_random_dl: lights,
                rt_samples: samples,
                ..bounced(bounces)
            };
            let mut sums = vec![[0.0f64; 2]; 256];
            let mut add = |_, pixels: &[Vec3]| {
                for (sums, pixel) in sums.iter_mut().zip(pixels) {
                    sums[0] += f64::from(pixel.x);
                    sums[1] += f64::from(pixel.x).powi(2);
                }
            };
            gpu.render_watched(&scene, &settings, FRAMES, |_, _| {}, Some(&mut add));
            let frames = f64::from(FRAMES);
            let mean = sums.iter().map(|s| s[0] / frames).sum::<f64>() / 256.0;
            let variance = |s: &[f64; 2]| s[1] / frames - (s[0] / frames).powi(2);
            (mean, sums.iter().map(variance).sum::<f64>() / 256.0)
        };
        let (mean, noise) = measured(1, 1);
        if !hidden {
            // all lights at once give the same light, however many samples are wanted
            for samples in [1, 4] {
                let (all, _) = measured(0, samples);
                assert!((all / mean - 1.0).abs() < 0.02, "{samples}: {all} {mean}");
            }
        }
        for samples in [2, 4, 8] {
            let (mean_of_more, less) = measured(1, samples);
            println!(
                "{samples}: {} of the light, {} of the noise",
                mean_of_more / mean,
                less / noise
            );
            assert!(
                (mean_of_more / mean - 1.0).abs() < 0.02,
                "{mean_of_more} {mean}"
            );
            let share = less / noise * f64::from(samples);
            assert!((0.8..1.25).contains(&share), "{samples}: {share}");
        }
    }
}
