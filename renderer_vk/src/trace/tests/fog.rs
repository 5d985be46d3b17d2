//! Fog against closed forms.

use glam::Vec3;
use shaders::types::Fog;

use super::harness::{Gpu, Scene, rectangle, reference, stage};
use super::layers::{TRANSLUCENT, close, displayed, screen};
use crate::settings::Settings;
use crate::trace::frame_lights::decode;

#[test]
fn fog_is_lit_by_what_lights_each_place_of_it() {
    Gpu::each(fog_is_lit_by_what_lights_each_place_of_it_with);
}

fn fog_is_lit_by_what_lights_each_place_of_it_with(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 1.0, 32);
    let black = scene.material(&[stage::constant([0.0; 3])], 0);
    scene.quad(screen(300.0), black);
    let depth = 400.0;
    scene.fogs.push(Fog {
        mins: Vec3::new(100.0, -500.0, -500.0),
        maxs: Vec3::new(200.0, 500.0, 500.0),
        plane: [0.0; 4],
        has_surface: 0,
        color: Vec3::new(0.2, 0.4, 0.6),
        depth,
        own_light: Vec3::ZERO,
    });
    // mixed as it is displayed: what is behind is black
    let ambient = decode(Vec3::new(0.2, 0.4, 0.6) * (100.0f32 / depth).sqrt());
    let (origin, radius, intensity) = (Vec3::new(130.0, 0.0, 30.0), 4.0f32, 9000.0f32);
    scene.points.push(relight::light::PointLight {
        origin,
        intensity: Vec3::splat(intensity),
        radius,
        spot: None,
        falloff: relight::light::Falloff::InverseSquare,
        pulse: None,
    });
    // the mean radiance over the sphere of directions, over what scatters at each place, shares the display as the fog's
    // own colour does
    let steps = 4000;
    let mut lit = 0.0;
    for i in 0..steps {
        let root = (i as f32 + 0.5) / steps as f32 * (100.0 / depth).sqrt();
        let place = Vec3::X * (100.0 + root * root * depth);
        let squared = (origin - place).length_squared();
        let sine_squared = radius * radius / squared;
        let cosine = (1.0 - sine_squared).sqrt();
        // 1 - cos without its cancellation
        let share = 0.5 * sine_squared / (1.0 + cosine);
        let radiance = intensity / (std::f32::consts::PI * radius * radius);
        lit += radiance * share / steps as f32;
    }
    let exact = ambient * lit;
    assert!(exact.y > 0.3 * ambient.y, "a test of nothing: {exact}");
    let filtered = Settings {
        rt_accumulate: false,
        rt_denoiser: 1,
        rt_taa: false,
        ..reference()
    };
    for (settings, frames, tolerance) in [(reference(), 16, 0.05), (filtered, 24, 0.1)] {
        let mean = gpu.mean(&scene, &settings, frames) - ambient;
        let error = ((mean - exact) / exact).abs().max_element();
        assert!(error < tolerance, "{mean} {exact}");
        // what the map's lights give in the mean is a part of the fog's colour, at most one half
        let own = Vec3::new(0.8, 0.2, 0.4);
        scene.fogs[0].own_light = own;
        let part = own.min(Vec3::splat(0.5));
        let exact = ambient * (1.0 - part) + exact * part / own;
        let mean = gpu.mean(&scene, &settings, frames);
        let error = ((mean - exact) / exact).abs().max_element();
        assert!(error < tolerance, "{mean} {exact}");
        scene.fogs[0].own_light = Vec3::ZERO;
    }
    // a screen between the light and the fog's nearer half; what glows is not lit
    let wall = scene.material(&[stage::constant([0.0; 3])], 0);
    scene.quad(
        rectangle(
            Vec3::new(0.0, -400.0, 10.0),
            Vec3::X * 400.0,
            Vec3::Y * 800.0,
        ),
        wall,
    );
    let dark = gpu.mean(&scene, &reference(), 2);
    assert!(close(dark, ambient), "{dark} {ambient}");
}

#[test]
fn fog_follows_the_way_through_its_volume() {
    Gpu::each(fog_follows_the_way_through_its_volume_with);
}

fn fog_follows_the_way_through_its_volume_with(gpu: &mut Gpu) {
    let mut scene = Scene::new(
        Vec3::new(0.0, 0.0, 50.0),
        Vec3::new(100.0, 0.0, 50.0),
        1.0,
        4,
    );
    let back = [0.9, 0.9, 0.9];
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    // from x = 100 to 200, below z = 80
    scene.fogs.push(Fog {
        mins: Vec3::new(100.0, -500.0, -500.0),
        maxs: Vec3::new(200.0, 500.0, 500.0),
        plane: [0.0, 0.0, -1.0, -80.0],
        has_surface: 1,
        color: Vec3::new(0.2, 0.4, 0.6),
        depth: 400.0,
        own_light: Vec3::ZERO,
    });
    let fog_color = Vec3::new(0.2, 0.4, 0.6);
    let back_shown = displayed(back);
    // what is displayed of a wall behind so much of the fog
    let behind = |length: f32, far: Vec3| {
        let factor = (length / 400.0).min(1.0).sqrt();
        fog_color * factor + far * (1.0 - factor)
    };
    let mean = gpu.mean(&scene, &reference(), 1);
    assert!(close(mean, decode(behind(100.0, back_shown))), "{mean}");
    // a layer in the middle: of the fog behind it the display shows what it leaves
    let veil = [0.1, 0.9, 0.1];
    let layer = scene.material(&[stage::blend(veil, 0.5)], TRANSLUCENT);
    scene.quad(screen(125.0), layer);
    let alpha = 127.0 / 255.0;
    let (front, whole) = ((25.0f32 / 400.0).sqrt(), (100.0f32 / 400.0).sqrt());
    let left = (1.0 - whole) / (1.0 - front);
    let far = fog_color * (1.0 - left) + back_shown * left;
    let exact = decode(behind(25.0, displayed(veil) * alpha + far * (1.0 - alpha)));
    let mean = gpu.mean(&scene, &reference(), 1);
    assert!(close(mean, exact), "{mean} {exact}");
    // above its surface there is none
    scene.surfaces.pop();
    scene.def.view_origin.z = 100.0;
    let mean = gpu.mean(&scene, &reference(), 1);
    assert!(close(mean, decode(back_shown)), "{mean}");
}
