//! The denoiser against the reference.

use glam::Vec3;
use relight::light::PointLight;

use super::harness::{Gpu, Scene, rectangle, reference};
use crate::settings::Settings;

/// A room with a pillar, a lamp and a small light that throws soft and hard shadows.
fn room() -> Scene {
    let mut scene = Scene::new(
        Vec3::new(-180.0, 0.0, 40.0),
        Vec3::new(100.0, 0.0, -20.0),
        70.0,
        64,
    );
    let grey = scene.diffuse(0.6);
    scene.room(
        Vec3::new(-200.0, -150.0, -80.0),
        Vec3::new(200.0, 150.0, 120.0),
        grey,
    );
    for side in [Vec3::X, Vec3::Y] {
        scene.quad(
            rectangle(Vec3::new(40.0, -20.0, -80.0), Vec3::Z * 120.0, side * 40.0),
            grey,
        );
    }
    let lamp = Vec3::new(0.0, 60.0, 110.0);
    scene.light(
        [lamp, lamp + Vec3::Y * 60.0, lamp + Vec3::X * 60.0],
        Vec3::splat(12.0),
    );
    scene.points.push(PointLight {
        origin: Vec3::new(-100.0, -100.0, 0.0),
        intensity: Vec3::splat(6000.0),
        radius: 4.0,
        spot: None,
    });
    scene
}

fn live() -> Settings {
    Settings {
        rt_accumulate: false,
        rt_bounces: 1,
        ..reference()
    }
}

/// Mean, and error against the truth: root of the mean square over the mean.
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

#[test]
fn filtered_frames_come_near_the_reference() {
    Gpu::each(filtered_frames_come_near_the_reference_with);
}

fn filtered_frames_come_near_the_reference_with(gpu: &mut Gpu) {
    let scene = room();
    let settings = Settings {
        rt_bounces: 1,
        ..reference()
    };
    let (truth, _) = gpu.render(&scene, &settings, 400);
    // one frame as it comes from the rays
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
    // what is left is mostly the smooth edges of the reference, which a frame without jitter has not
    assert!(error < 0.25 * raw_error, "{error} {raw_error}");

    // a camera that moves and turns ends where the truth was taken
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

#[test]
fn light_that_goes_out_is_gone_soon() {
    Gpu::each(light_that_goes_out_is_gone_soon_with);
}

fn light_that_goes_out_is_gone_soon_with(gpu: &mut Gpu) {
    // a wall slides over everything: what it shows must not come from what was there before
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, 32);
    let white = scene.diffuse(1.0);
    let black = scene.material(
        &[
            super::harness::stage::light(),
            super::harness::stage::filter([0.0; 3]),
        ],
        0,
    );
    scene.ambient = Vec3::ONE;
    scene.quad(
        rectangle(
            Vec3::new(300.0, -900.0, -900.0),
            Vec3::Z * 1800.0,
            Vec3::Y * 1800.0,
        ),
        white,
    );
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
