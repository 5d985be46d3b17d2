//! Light of further bounces at the last one (`rt_bounceAmbient`).

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use q3bsp::{Bsp, GridPoint};
use relight::light::LightLists;

use super::bounces::{furnace, seen};
use super::harness::{Gpu, Scene, bounced, ceiling_at, encode, floor_at, gpu_tests, through_byte};
use crate::settings::Settings;

gpu_tests! {
    any: [
        ambient_light_completes_a_furnace,
        ambient_light_falls_with_the_length_of_the_ray,
    ],
}

/// A map of one cell with an even light grid, of this linear radiance; and what a quarter of the byte shows.
fn even_grid(radiance: f32) -> (Bsp, f32) {
    let byte = (encode(radiance) * 255.0 / 4.0).round();
    let mut map = MapBuilder::new();
    let stone = map.add_shader("stone", 0, 0);
    map.add_cell(Vec3::splat(-512.0), Vec3::splat(512.0));
    let corners = [Vec3::ZERO, Vec3::Y, Vec3::ONE - Vec3::Z, Vec3::X];
    map.add_quad(stone, corners.map(|p| p * 1024.0 - 512.0));
    let point = GridPoint {
        ambient: [byte as u8; 3],
        directed: [0; 3],
        longitude: 0,
        latitude: 0,
    };
    let bsp = map.build_with_grid(Vec3::splat(64.0), |_| point);
    (bsp, relight::overbright::to_linear(4.0 * byte / 255.0))
}

/// Puts a scene into a map of one cell.
fn in_cell(scene: &mut Scene, bsp: Bsp) {
    let count = (scene.lights.len() + scene.points.len()) as u32;
    let lists = LightLists {
        offsets: vec![0, count, 2 * count],
        lights: (0..count).chain(0..count).collect(),
        triangle_lights: scene.lights.len() as u32,
        sky: vec![false],
        shares: Vec::new(),
    };
    scene.tree = Some((bsp, lists));
}

fn ambient(part: f32, fall: f32) -> Settings {
    Settings {
        rt_bounce_ambient: part,
        rt_bounce_ambient_fall: fall,
        ..bounced(1)
    }
}

fn ambient_light_completes_a_furnace(gpu: &mut Gpu) {
    // every wall emits e and reflects a: the light that arrives is e / (1 - a) after infinitely many bounces
    for albedo in [0.25, 0.5] {
        let [e, a] = [0.25, albedo].map(|v| through_byte(encode(v)));
        let mut scene = furnace(albedo, 1.0);
        let (bsp, radiance) = even_grid(0.5);
        in_cell(&mut scene, bsp);
        for (part, bounces) in [(0.0, 1), (e / (1.0 - a) / radiance, 1), (0.5, 1), (0.5, 3)] {
            let settings = Settings {
                rt_bounces: bounces,
                ..ambient(part, 0.0)
            };
            let own: f32 = (0..bounces).map(|n| e * a.powi(n as i32)).sum();
            let exact = seen(e, a, own + a.powi(bounces as i32) * part * radiance);
            let mean = gpu.mean(&scene, &settings, 32).x;
            println!("albedo {albedo}, {part}, {bounces}: {mean} {exact}");
            assert!((mean / exact - 1.0).abs() < 0.005, "{mean} {exact}");
        }
    }
}

fn ambient_light_falls_with_the_length_of_the_ray(gpu: &mut Gpu) {
    // a ceiling of the albedo a at the height h above a white floor: the light that arrives is 2 a A E3(k h)
    const HEIGHT: f32 = 40.0;
    let camera = Vec3::new(-20.0, 0.0, 20.0);
    let mut scene = Scene::new(camera, Vec3::ZERO, 4.0, 32);
    let white = scene.diffuse(1.0);
    let grey = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 500.0), white);
    scene.quad(ceiling_at(HEIGHT, 500.0), grey);
    let (bsp, radiance) = even_grid(0.5);
    in_cell(&mut scene, bsp);
    let albedo = through_byte(encode(0.5));
    for fall in [0.0, 0.01, 0.05] {
        let steps = 10_000;
        let integral: f32 = (0..steps)
            .map(|i| {
                let cosine = (i as f32 + 0.5) / steps as f32;
                // the rays that miss the ceiling are below 0.7 % of the light
                2.0 * cosine * (-fall * HEIGHT / cosine).exp() / steps as f32
            })
            .sum();
        let exact = albedo * 0.8 * radiance * integral;
        let mean = gpu.mean(&scene, &ambient(0.8, fall), 64).x;
        println!("fall {fall}: {mean} {exact}");
        assert!((mean / exact - 1.0).abs() < 0.015, "{mean} {exact}");
    }
}
