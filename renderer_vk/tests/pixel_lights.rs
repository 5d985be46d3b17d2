//! Dynamic lights of the classic look that are evaluated per pixel (`r_dlightMode`), beside the closed form.
//!
//! Without a device the test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

use std::sync::Arc;

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::MemoryFiles;
use renderer_vk::api::{DynamicLight, RefDef};
use renderer_vk::{Renderer, RendererOptions, Settings};

/// Side of the picture, pixels.
const SIDE: usize = 64;
/// Distance of the wall from the camera, units.
const WALL: f32 = 256.0;
/// Value of the wall's texture, of 255.
const TEXTURE: u8 = 128;
/// Brightness of the wall without dynamic lights, of 255: the texture times `rgbGen const`.
const DARK: f32 = 12.8;

const SCRIPT: &[u8] = b"t/wall { { map t/grey.tga
  rgbGen const ( 0.1 0.1 0.1 ) } }";

/// A light 100 units before the wall, in the middle of the picture, that reaches 200 units.
const LIGHT: DynamicLight = DynamicLight {
    origin: Vec3::new(WALL - 100.0, 0.0, 0.0),
    radius: 200.0,
    color: Vec3::splat(0.5),
    additive: false,
    end: None,
};

/// Brightness of the wall at `y` units from the middle: diffuse and highlight of `LIGHT` with this reach.
fn expected(y: f32, radius: f32, specular: f32, power: f32) -> f32 {
    let to_light = Vec3::new(-100.0, -y, 0.0);
    let to_camera = Vec3::new(-WALL, -y, 0.0).normalize();
    let falloff = (1.0 - to_light.length_squared() / (radius * radius)).max(0.0);
    let cosine = to_light.normalize().dot(Vec3::NEG_X);
    let half = (to_light.normalize() + to_camera)
        .normalize()
        .dot(Vec3::NEG_X);
    let reflected = f32::from(TEXTURE) * (cosine + specular * half.powf(power));
    DARK + reflected * falloff * LIGHT.color.x
}

/// Red of the middle row.
fn row(renderer: &mut Renderer, settings: &Settings) -> Vec<f32> {
    renderer.set_settings(settings);
    renderer.begin_frame(5000);
    renderer.clear_scene();
    renderer.add_light(LIGHT);
    let def = RefDef {
        width: SIDE as i32,
        height: SIDE as i32,
        fov_x: 90.0,
        fov_y: 90.0,
        time_ms: 5000,
        ..RefDef::default()
    };
    renderer.render_scene(&def).unwrap();
    let picture = renderer.read_pixels().unwrap();
    renderer.end_frame().unwrap();
    let from = SIDE * (SIDE / 2) * 3;
    picture.rgb[from..from + SIDE * 3]
        .iter()
        .step_by(3)
        .map(|&red| f32::from(red))
        .collect()
}

#[test]
fn lights_per_pixel_have_the_engines_falloff_and_highlight() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    map.add_room(wall, Vec3::splat(-WALL), Vec3::splat(WALL));
    let mut files = MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).unwrap();
    let mut grey = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0];
    grey.extend([TEXTURE; 3]);
    files.insert("t/grey.tga", grey).unwrap();
    files.insert("maps/t.bsp", map.build().write()).unwrap();
    let settings = Settings {
        dlight_mode: 1,
        dlight_scale: 1.0,
        dlight_specular: 0.0,
        ..Settings::full_size()
    };
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(SIDE as u32, SIDE as u32)
    };
    let Some(mut renderer) = testkit::device(Renderer::new(options)) else {
        return;
    };
    renderer
        .begin_registration(Arc::new(files), &settings)
        .unwrap();
    renderer.load_world("maps/t.bsp").unwrap();
    renderer.end_registration();
    let cases = [
        (settings.clone(), 200.0, 0.0, 8.0),
        // the texture's highlight, and half the reach
        (
            Settings {
                dlight_specular: -0.5,
                ..settings.clone()
            },
            200.0,
            0.5,
            8.0,
        ),
        (
            Settings {
                dlight_specular: -0.5,
                dlight_specular_power: 32.0,
                ..settings.clone()
            },
            200.0,
            0.5,
            32.0,
        ),
        (
            Settings {
                dlight_scale: 0.75,
                ..settings.clone()
            },
            150.0,
            0.0,
            8.0,
        ),
    ];
    for (settings, radius, specular, power) in cases {
        let lit = row(&mut renderer, &settings);
        let mut reached = 0;
        for (x, &value) in lit.iter().enumerate() {
            // 90 degrees: the picture is as wide as the wall
            let y = WALL * (1.0 - (x as f32 + 0.5) / (SIDE as f32 / 2.0));
            let wanted = expected(y, radius, specular, power);
            reached += usize::from(wanted > DARK + 1.0);
            assert!(
                (value - wanted).abs() <= 1.5,
                "{x}: {value}, expected {wanted} ({radius}, {specular}, {power})"
            );
        }
        assert!(
            (20..50).contains(&reached),
            "{reached} of {SIDE} pixels are lit"
        );
    }
    // a spot is something else
    let spot = row(
        &mut renderer,
        &Settings {
            dlight_mode: 0,
            ..settings
        },
    );
    assert!(
        (spot[SIDE / 2] - expected(0.0, 200.0, 0.0, 8.0)).abs() > 3.0,
        "{spot:?}"
    );
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}
