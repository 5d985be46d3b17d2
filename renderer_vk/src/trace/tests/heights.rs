//! Heights of normal maps (`r_parallaxMapping`): equal heights show the texture as a surface farther away does.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use shaders::types::constants as c;

use super::dielectrics::square;
use super::harness::{Gpu, Scene, floor_at, gpu_tests, reference, stage};
use crate::gpu::Image;
use crate::settings::Settings;

gpu_tests! {
    each: [heights_move_the_texture_that_rays_of_sight_meet],
}

/// Pixels and texels on each side.
const SIDE: u32 = 64;
/// Alpha of the heights, and the depth of an alpha of 0.
const HEIGHT: u8 = 128;
const DEPTH: f32 = 0.5;

/// A floor of 128 units below a camera at the same height. `scale`: of the texture coordinates about its middle.
fn floor([texture, heights]: [&Image; 2], scale: f32, flags: u32) -> Scene {
    let mut scene = Scene::new(Vec3::Z * 128.0, Vec3::ZERO, 50.0, SIDE as i32);
    scene.images.push(texture.texture_index());
    let material = scene.material(&[stage::image(0)], 0);
    let of_floor = &mut scene.materials[material as usize];
    of_floor.0.flags |= flags;
    of_floor.1.flags |= flags;
    of_floor.0.specular.normals = heights.texture_index();
    of_floor.0.specular.normal_scale = Vec2::ZERO;
    of_floor.0.specular.depth = DEPTH;
    scene.quad(floor_at(0.0, 64.0), material);
    for vertex in &mut scene.vertices {
        vertex.st = Vec2::splat(0.5) + (vertex.st - 0.5) * scale;
    }
    scene.ambient = Vec3::ONE;
    scene
}

fn heights_move_the_texture_that_rays_of_sight_meet(gpu: &mut Gpu) {
    let wave = |i: u32| {
        let [x, y] = [i % SIDE, i / SIDE].map(|place| place as f32 / SIDE as f32 * TAU);
        (128.0 + 60.0 * (x * 2.0).sin() * (y * 3.0).cos()) as u8
    };
    let waves = (0..SIDE * SIDE).flat_map(|i| [wave(i), wave(i), wave(i), 255]);
    let waves = square(gpu, SIDE, &waves.collect::<Vec<u8>>());
    let heights = square(gpu, 2, &[128, 128, 255, HEIGHT].repeat(4));
    let mut draw = |scale, flags, parallax_mapping| {
        let settings = Settings {
            rt_bounces: 0,
            rt_antialiasing: false,
            parallax_mapping,
            ..reference()
        };
        let scene = floor([&waves, &heights], scale, flags);
        let (linear, _) = gpu.render_watched(&scene, &settings, 1, |_, _| {}, None);
        linear
    };
    let greatest = |a: &[Vec3], b: &[Vec3]| {
        let pairs = a.iter().zip(b);
        let error = |(a, b): (&Vec3, &Vec3)| (*a - *b).abs().max_element();
        pairs.map(error).fold(0.0, f32::max)
    };
    let with = c::MATERIAL_NORMALS | c::MATERIAL_HEIGHTS;
    let plain = draw(1.0, with, 0);
    let below = 1.0 - f32::from(HEIGHT) / 255.0;
    // `r_parallaxMapping 1` adds a step of 1/16
    for (mode, depth) in [(1, below + 1.0 / 16.0), (2, below)] {
        let moved = draw(1.0, with, mode);
        // one unit of length is 1/128 of the texture, and the eye is 128 units away
        let farther = draw(1.0 + depth * DEPTH, with, 0);
        let [change, error] = [&plain, &farther].map(|other| greatest(other, &moved));
        println!("{mode}: change {change}, error {error}");
        assert!(change > 0.1 && error < change * 0.06, "{mode}");
    }
    // without heights nothing is moved
    assert!(draw(1.0, c::MATERIAL_NORMALS, 2) == plain);
}
