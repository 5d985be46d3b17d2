//! Rough surfaces: white furnaces, agreement of estimators, limits of smooth and rough.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use shaders::trace_types::{SkyRecord, constants as t};
use shaders::types::{Dielectric, Specular, Stage, constants as c};

use super::bounces::{by_each_way, furnace, seen};
use super::dielectrics::square;
use super::harness::{
    Gpu, Scene, bounced, encode, floor_at, gpu_tests, identity, rectangle, reference, stage,
    through_byte,
};
use crate::settings::{DenoiserChoice, Settings};

gpu_tests! {
    any: [
        a_white_furnace_keeps_its_energy,
        light_samples_and_rays_find_the_same_light,
        a_smooth_metal_is_a_mirror,
        a_sun_shows_in_a_rough_floor,
        rough_surfaces_light_others,
        live_frames_have_the_same_mean,
        live_light_comes_to_rest,
        normal_maps_turn_the_surface,
        marks_leave_the_gloss_of_their_surface,
        maps_of_roughness_and_metal_are_factors,
        maps_of_reflectance_and_smoothness_are_factors,
        a_pane_shows_the_gloss_behind_it,
        frosted_panes_scatter_what_is_behind_them,
        maps_of_glow_show_and_light,
    ],
}

/// Gives a material specular reflection.
fn shine(scene: &mut Scene, material: u32, roughness: f32, metal: f32, reflectance: f32) {
    let gpu = &mut scene.materials[material as usize];
    gpu.0.flags |= c::MATERIAL_ROUGH;
    gpu.1.flags |= c::MATERIAL_ROUGH;
    gpu.0.specular = Specular {
        roughness,
        metal,
        reflectance: Vec3::splat(reflectance),
        map: c::NO_TEXTURE,
        normals: c::NO_TEXTURE,
        stage: c::NO_STAGE,
        ..Specular::default()
    };
}

/// A white ball before an even sky of radiance `sky`.
fn ball_in_a_furnace(roughness: f32, metal: f32, reflectance: f32) -> Scene {
    let camera = Vec3::new(-100.0, 0.0, 0.0);
    let mut scene = Scene::new(camera, Vec3::ZERO, 12.0, 12);
    let white = scene.diffuse(1.0);
    shine(&mut scene, white, roughness, metal, reflectance);
    scene.ball(Vec3::ZERO, 18.0, 32, white, true);
    let glow = scene.material(&[stage::constant([encode(0.5); 3])], 0);
    scene.room(Vec3::splat(-300.0), Vec3::splat(300.0), glow);
    scene
}

fn a_white_furnace_keeps_its_energy(gpu: &mut Gpu) {
    let sky = through_byte(encode(0.5));
    for (metal, reflectance) in [(1.0, 0.0), (0.0, 0.04), (0.0, 0.5), (0.5, 0.04)] {
        for roughness in [0.0, 0.2, 0.4, 0.7, 1.0] {
            let scene = ball_in_a_furnace(roughness, metal, reflectance);
            let mean = gpu.mean(&scene, &bounced(1), 64).x;
            println!(
                "metal {metal}, {reflectance}, roughness {roughness}: {}",
                mean / sky
            );
            assert!(
                (mean / sky - 1.0).abs() < 0.003,
                "metal {metal}, reflectance {reflectance}, roughness {roughness}: {}",
                mean / sky
            );
        }
    }
}

/// A floor of metal below a lamp that faces down.
fn floor_below_a_lamp(roughness: f32) -> Scene {
    let mut scene = Scene::new(
        Vec3::new(-60.0, 0.0, 40.0),
        Vec3::new(0.0, 0.0, 0.0),
        50.0,
        16,
    );
    let grey = scene.diffuse(0.5);
    shine(&mut scene, grey, roughness, 0.5, 0.04);
    scene.quad(floor_at(0.0, 500.0), grey);
    let lamp = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_EMITTER);
    // the corners of a ceiling's quad are clockwise from below
    let corner = Vec3::new(20.0, -25.0, 60.0);
    let [a, b, c, d] = rectangle(corner, Vec3::Y * 50.0, Vec3::X * 50.0);
    scene.quad([a, b, c, d], lamp);
    for triangle in [[a, b, c], [a, c, d]] {
        scene.light(triangle, Vec3::splat(4.0));
    }
    for light in &mut scene.lights {
        light.surface = 1;
    }
    scene.lights_are_hittable = true;
    scene
}

/// The picture by each estimator.
fn by_estimators(gpu: &mut Gpu, scene: &Scene, settings: &Settings, frames: u32) -> [Vec<Vec3>; 3] {
    [t::SPECULAR_BOTH, t::SPECULAR_LIGHTS, t::SPECULAR_RAYS].map(|estimator| {
        gpu.look.specular_estimator = estimator;
        let (pixels, _) = gpu.render(scene, settings, frames);
        gpu.look.specular_estimator = t::SPECULAR_BOTH;
        pixels
    })
}

fn mean_of(pixels: &[Vec3]) -> f32 {
    pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32
}

fn light_samples_and_rays_find_the_same_light(gpu: &mut Gpu) {
    for roughness in [0.3, 0.6, 1.0] {
        let scene = floor_below_a_lamp(roughness);
        let pictures = by_estimators(gpu, &scene, &reference(), 512);
        let [both, lights, rays] = [0, 1, 2].map(|i| mean_of(&pictures[i]));
        println!("{roughness}: {both} {lights} {rays}");
        assert!(
            (lights / both - 1.0).abs() < 0.01,
            "{roughness}: {both} {lights}"
        );
        assert!(
            (rays / both - 1.0).abs() < 0.01,
            "{roughness}: {both} {rays}"
        );
        // the lamp's own part of the picture
        assert!(both > 0.05);
    }
}

fn a_smooth_metal_is_a_mirror(gpu: &mut Gpu) {
    // the roughness of 0 is the smallest that packed directions allow: nearly a mirror
    let room = |scene: &mut Scene| {
        let glow = scene.material(&[stage::constant([encode(0.5), encode(0.2), 0.0])], 0);
        let wall = rectangle(Vec3::new(60.0, -80.0, 0.0), Vec3::Z * 60.0, Vec3::Y * 160.0);
        scene.quad(wall, glow);
    };
    let camera = (Vec3::new(-60.0, 0.0, 40.0), Vec3::new(0.0, 0.0, 0.0));
    let mut rough = Scene::new(camera.0, camera.1, 30.0, 16);
    let white = rough.diffuse(1.0);
    shine(&mut rough, white, 0.0, 1.0, 0.0);
    rough.quad(floor_at(0.0, 500.0), white);
    room(&mut rough);
    let mut sharp = Scene::new(camera.0, camera.1, 30.0, 16);
    let mirror = sharp.diffuse(1.0);
    let gpu_material = &mut sharp.materials[mirror as usize];
    gpu_material.0.flags |= c::MATERIAL_REFLECTS;
    gpu_material.1.flags |= c::MATERIAL_REFLECTS;
    gpu_material.0.specular.mirror = Vec3::ONE;
    sharp.quad(floor_at(0.0, 500.0), mirror);
    room(&mut sharp);
    let (a, _) = gpu.render(&rough, &reference(), 256);
    let (b, _) = gpu.render(&sharp, &reference(), 64);
    let error = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b).abs().element_sum())
        .sum::<f32>()
        / 256.0;
    println!("{} {} {error}", mean_of(&a), mean_of(&b));
    assert!((mean_of(&a) / mean_of(&b) - 1.0).abs() < 0.01);
    assert!(error < 0.02, "{error}");
}

fn a_sun_shows_in_a_rough_floor(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::new(-60.0, 0.0, 40.0), Vec3::ZERO, 50.0, 16);
    let white = scene.diffuse(0.5);
    shine(&mut scene, white, 0.5, 1.0, 0.0);
    scene.quad(floor_at(0.0, 500.0), white);
    scene.sun(Vec3::new(0.8, 0.0, 0.6), 3.0, 0.05);
    let no_box = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: 512.0,
    };
    let sky = scene.sky(&[], no_box);
    scene.room(Vec3::splat(-600.0), Vec3::splat(600.0), sky);
    let pictures = by_estimators(gpu, &scene, &reference(), 512);
    let [both, lights, rays] = [0, 1, 2].map(|i| mean_of(&pictures[i]));
    println!("{both} {lights} {rays}");
    assert!((lights / both - 1.0).abs() < 0.01);
    // few rays meet the disc
    assert!((rays / both - 1.0).abs() < 0.06);
    assert!(both > 0.05);
}

fn rough_surfaces_light_others(gpu: &mut Gpu) {
    // walls of metal emit e and reflect all light: the first surface shows the emission of each that follows
    let e = through_byte(encode(0.25));
    for roughness in [0.3, 0.8] {
        let mut scene = furnace(1.0, 1.0);
        shine(&mut scene, 0, roughness, 1.0, 0.0);
        for bounces in [0, 1, 3] {
            // the surface that the lobe's ray hits has `bounces` bounces of its own, as behind a mirror
            let exact = seen(e, 1.0, e * (bounces + 1) as f32);
            let mean = gpu.mean(&scene, &bounced(bounces), 32).x;
            println!("roughness {roughness}, {bounces} bounces: {mean} {exact}");
            assert!((mean / exact - 1.0).abs() < 0.005, "{roughness}, {bounces}");
        }
    }
}

fn live_frames_have_the_same_mean(gpu: &mut Gpu) {
    let scene = floor_below_a_lamp(0.5);
    let [exact, live] = by_each_way(gpu, &scene, &bounced(1), 64).map(|mean| mean.x);
    println!("{exact} {live}");
    assert!((live / exact - 1.0).abs() < 0.02, "{exact} {live}");
}

fn live_light_comes_to_rest(gpu: &mut Gpu) {
    // each pixel has traced eight paths in 32 frames; edges differ, because only the mean of many frames jitters pixels
    let live = Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_taa: false,
        ..bounced(1)
    };
    for roughness in [0.1, 0.3, 0.6] {
        let scene = floor_below_a_lamp(roughness);
        let (exact, _) = gpu.render(&scene, &bounced(1), 512);
        let error = |pixels: &[Vec3]| {
            let squares = (pixels.iter().zip(&exact)).map(|(a, b)| (a.x - b.x).powi(2));
            (squares.sum::<f32>() / 256.0).sqrt() / mean_of(&exact)
        };
        let mut errors = Vec::new();
        let mut watch = |_, pixels: &[Vec3]| errors.push(error(pixels));
        gpu.render_watched(&scene, &live, 32, |_, _| {}, Some(&mut watch));
        println!("{roughness}: {} {}", errors[0], errors[31]);
        assert!(errors[31] < 0.7 * errors[0], "{errors:?}");
    }
}

fn normal_maps_turn_the_surface(gpu: &mut Gpu) {
    // without roughness: a material may have normals alone
    for (red, green, direction) in [(204, 128, Vec3::X), (128, 204, Vec3::NEG_Y)] {
        let texels: Vec<u8> = [red, green, 230, 255].repeat(4);
        let image = square(gpu, 2, &texels);
        for side in [1.0, -1.0] {
            let mut scene = Scene::new(Vec3::new(0.0, 0.0, 60.0), Vec3::ZERO, 30.0, 8);
            let white = scene.diffuse(1.0);
            let material = &mut scene.materials[white as usize];
            material.0.flags |= c::MATERIAL_NORMALS;
            material.1.flags |= c::MATERIAL_NORMALS;
            material.0.specular.normals = image.texture_index();
            material.0.specular.normal_scale = Vec2::ONE;
            scene.quad(floor_at(0.0, 500.0), white);
            let sun = direction * (0.6 * side) + Vec3::Z * 0.8;
            scene.sun(sun, 3.0, 0.001);
            let mean = gpu.mean(&scene, &reference(), 4).x;
            // the normal is 0.6 along the axis and 0.8 up
            let exact = 3.0 / PI * (0.36 * side + 0.64);
            println!("{red} {green} {side}: {mean} {exact}");
            assert!((mean / exact - 1.0).abs() < 0.02, "{red} {green} {side}");
        }
    }
}

fn marks_leave_the_gloss_of_their_surface(gpu: &mut Gpu) {
    let mut scene = floor_below_a_lamp(0.3);
    let plain = gpu.mean(&scene, &reference(), 256).x;
    let faint = Stage {
        flags: c::STAGE_MATTER | c::STAGE_WHITE,
        ..stage::blend([0.5; 3], 4.0 / 255.0)
    };
    let flags = c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED | c::MATERIAL_POLYGON_OFFSET;
    let mark = scene.material(&[faint], flags);
    scene.mesh(floor_at(0.1, 400.0), mark, identity());
    let marked = gpu.mean(&scene, &reference(), 256).x;
    println!("{plain} {marked}");
    assert!((marked / plain - 1.0).abs() < 0.05, "{plain} {marked}");
}

fn a_pane_shows_the_gloss_behind_it(gpu: &mut Gpu) {
    // a pane splits pixels into those that show its reflection and those that show what is behind it
    for metal in [0.5, 1.0] {
        let mut scene = floor_below_a_lamp(0.4);
        scene.materials[0].0.specular.metal = metal;
        let flags = c::MATERIAL_GLASS | c::MATERIAL_TRANSLUCENT;
        let pane = scene.material(&[stage::filter([1.0; 3])], flags);
        scene.materials[pane as usize].0.dielectric = Dielectric {
            index: 1.5,
            scale: 1.0,
            ..Dielectric::default()
        };
        scene.quad(floor_at(20.0, 400.0), pane);
        let [exact, live] = by_each_way(gpu, &scene, &bounced(1), 64).map(|mean| mean.x);
        println!("{metal}: {exact} {live}");
        // a diffuse floor behind the pane is 4.5 % darker live
        assert!((live / exact - 1.0).abs() < 0.08, "{metal}: {exact} {live}");
    }
}

fn maps_of_roughness_and_metal_are_factors(gpu: &mut Gpu) {
    let image = square(gpu, 2, &[255, 128, 51, 255].repeat(4));
    let mut mapped = floor_below_a_lamp(0.8);
    mapped.materials[0].0.specular.map = image.texture_index();
    let mut stated = floor_below_a_lamp(0.8 * 128.0 / 255.0);
    stated.materials[0].0.specular.metal *= 0.2;
    let [mapped, stated] = [mapped, stated].map(|scene| gpu.mean(&scene, &reference(), 256).x);
    println!("{mapped} {stated}");
    assert!((mapped / stated - 1.0).abs() < 0.005, "{mapped} {stated}");
}

fn maps_of_reflectance_and_smoothness_are_factors(gpu: &mut Gpu) {
    // display-encoded 188 is 0.5 linear; an alpha of 153 is a smoothness of 0.6
    let image = square(gpu, 2, &[188, 188, 188, 153].repeat(4));
    let mut mapped = floor_below_a_lamp(0.5);
    let mut stated = floor_below_a_lamp(1.0 - 0.6 * 0.5);
    for scene in [&mut mapped, &mut stated] {
        scene.materials[0].0.specular.metal = 0.0;
    }
    mapped.materials[0].0.flags |= c::MATERIAL_SPECULAR_MAP;
    mapped.materials[0].0.specular.map = image.texture_index();
    mapped.materials[0].0.specular.reflectance = Vec3::new(0.8, 0.4, 0.1);
    stated.materials[0].0.specular.reflectance = Vec3::new(0.4, 0.2, 0.05);
    let [mapped, stated] = [mapped, stated].map(|scene| gpu.mean(&scene, &reference(), 256));
    println!("{mapped} {stated}");
    assert!(
        (mapped / stated - 1.0).abs().max_element() < 0.01,
        "{mapped} {stated}"
    );
}

/// A pane before a floor that glows where y < 0, or everywhere; columns of pixels from left to right.
fn behind_a_pane(gpu: &mut Gpu, roughness: f32, whole: bool) -> Vec<f32> {
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 60.0), Vec3::ZERO, 40.0, 8);
    let glow = scene.material(&[stage::constant([1.0; 3])], 0);
    let dark = scene.material(&[stage::constant([0.0; 3])], 0);
    for (y, material) in [(-400.0, glow), (0.0, if whole { glow } else { dark })] {
        let corner = Vec3::new(-400.0, y, 0.0);
        scene.quad(
            rectangle(corner, Vec3::X * 800.0, Vec3::Y * 400.0),
            material,
        );
    }
    let flags = c::MATERIAL_GLASS | c::MATERIAL_TRANSLUCENT | c::MATERIAL_ROUGH;
    let pane = scene.material(&[stage::filter([1.0; 3])], flags);
    scene.materials[pane as usize].0.dielectric = Dielectric {
        index: 1.5,
        scale: 1.0,
        ..Dielectric::default()
    };
    scene.materials[pane as usize].0.specular.roughness = roughness;
    scene.quad(floor_at(20.0, 400.0), pane);
    let (pixels, _) = gpu.render(&scene, &reference(), 256);
    let column = |x: usize| (0..8).map(|y| pixels[y * 8 + x].x).sum::<f32>() / 8.0;
    (0..8).map(column).collect()
}

fn frosted_panes_scatter_what_is_behind_them(gpu: &mut Gpu) {
    let pixel = 60.0 * 20.0_f32.to_radians().tan() / 4.0;
    for roughness in [0.0, 0.3] {
        let whole = behind_a_pane(gpu, roughness, true);
        let half = behind_a_pane(gpu, roughness, false);
        println!("{roughness}: {whole:?} {half:?}");
        let mean = whole.iter().sum::<f32>() / 8.0;
        // a pane of index 1.5 passes 12/13
        assert!((mean * 13.0 / 12.0 - 1.0).abs() < 0.005, "{mean}");
        // A ray that leaves by a facet of the slope s turns by (1.5 - 1) s, and GGX has a slope above x in one direction
        // with the probability (1 - x / sqrt(x^2 + alpha^2)) / 2. In the first pixel beyond the edge its mean is:
        let k = 20.0 * 0.5 * roughness * roughness;
        let exact = 0.5 * (1.0 - ((pixel * pixel + k * k).sqrt() - k) / pixel) * mean;
        let beyond = half[3];
        assert!(
            (beyond - exact).abs() < 0.05 * exact + 0.004,
            "{beyond} {exact}"
        );
        assert!((half[3] + half[4] - mean).abs() < 0.01, "{half:?}");
    }
}

fn maps_of_glow_show_and_light(gpu: &mut Gpu) {
    // display-encoded 188 is 0.503 linear
    let image = square(gpu, 1, &[188, 188, 0, 255]);
    let mut room = Scene::new(Vec3::ZERO, Vec3::X, 90.0, 12);
    let material = room.diffuse(0.5);
    let shining = &mut room.materials[material as usize].0;
    shining.flags |= c::MATERIAL_GLOWS;
    shining.specular.glow = image.texture_index();
    shining.specular.glow_radiance = 3.0;
    room.room(Vec3::splat(-64.0), Vec3::splat(64.0), material);
    let shown = gpu.mean(&room, &reference(), 16);
    let exact = 3.0 * through_byte(188.0 / 255.0);
    assert!(
        (shown / exact - Vec3::new(1.0, 1.0, 0.0))
            .abs()
            .max_element()
            < 0.01,
        "{shown} {exact}"
    );
    // the sum of bounces in a room of albedo 0.5
    for (bounces, sum) in [(1, 1.5), (2, 1.75)] {
        let mean = gpu.mean(&room, &bounced(bounces), 64).x;
        println!("{mean} {}", exact * sum);
        assert!(
            (mean / (exact * sum) - 1.0).abs() < 0.01,
            "{mean} {}",
            exact * sum
        );
    }
}
