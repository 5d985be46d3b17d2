//! Bloom spreads light and preserves its sum.

use glam::Vec3;

use super::harness::{Gpu, Scene, gpu_tests, rectangle, reference};
use crate::settings::Settings;

gpu_tests! {
    compute: [
        bloom_keeps_even_light_and_the_sum_of_uneven_light,
    ],
}

const SIZE: i32 = 150;

/// Linear values of the picture: display values decoded, below the shoulder of the tone curve.
fn linear(picture: &[[u8; 4]]) -> Vec<f32> {
    let decode =
        |p: &[u8; 4]| crate::trace::frame_lights::decode(Vec3::splat(f32::from(p[1]) / 255.0)).x;
    picture.iter().map(decode).collect()
}

fn bloom_keeps_even_light_and_the_sum_of_uneven_light(gpu: &mut Gpu) {
    let settings = |bloom| Settings {
        rt_bloom: bloom,
        rt_illumination: false,
        ..reference()
    };
    // the camera looks down on a floor with a brighter square in its middle
    let scene = |middle: f32| {
        let mut scene = Scene::new(Vec3::new(0.0, 0.0, 100.0), Vec3::ZERO, 90.0, SIZE);
        let ground = scene.diffuse(0.05);
        let square = scene.diffuse(middle);
        let place = |half: f32, z: f32| {
            let corner = Vec3::new(-half, -half, z);
            rectangle(corner, Vec3::X * 2.0 * half, Vec3::Y * 2.0 * half)
        };
        scene.quad(place(1000.0, 0.0), ground);
        scene.quad(place(15.0, 0.5), square);
        scene
    };
    let mut shown = |middle, bloom| linear(&gpu.render(&scene(middle), &settings(bloom), 1).1);
    let (even, even_bloomed) = (shown(0.05, 0.0), shown(0.05, 0.5));
    for (a, b) in even.iter().zip(&even_bloomed) {
        assert!((a - b).abs() < 0.003, "{a} {b}");
    }
    let (plain, bloomed) = (shown(0.5, 0.0), shown(0.5, 0.5));
    let sum = |picture: &[f32]| picture.iter().sum::<f32>();
    let ratio = sum(&bloomed) / sum(&plain);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    // light is spread from the square and falls off around it
    let at = |picture: &[f32], right: i32| picture[(SIZE / 2 * SIZE + SIZE / 2 + right) as usize];
    assert!(at(&bloomed, 0) < at(&plain, 0) * 0.95);
    let glow = [16, 30, 60].map(|right| at(&bloomed, right) - at(&plain, right));
    assert!(
        glow[0] > glow[1] && glow[1] > glow[2] && glow[0] > 0.01,
        "{glow:?}"
    );
}
