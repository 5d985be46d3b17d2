//! Output of more than white (`rt_hdr`): the image that a window would show, beside closed forms.
//!
//! Without a device the tests are skipped; with `RELIGHT_REQUIRE_GPU=1` they fail.

mod common;

use std::sync::Arc;

use common::{frame, load_sample};
use glam::Vec2;
use relight::{GameFiles, MemoryFiles};
use renderer_vk::api::{Picture, UiFrame, UiMesh, UiTexture, UiVertex};
use renderer_vk::{HdrChoice, Look, Renderer, RendererOptions, Settings};

const SIZE: (u32, u32) = (96, 54);

/// Brightness of white, cd/m².
const WHITE: f32 = 203.0;
/// Brightest light, cd/m².
const PEAK: f32 = 800.0;

fn renderer(hdr: HdrChoice) -> Option<Renderer> {
    testkit::device(Renderer::new(RendererOptions {
        validation: true,
        hdr,
        ..RendererOptions::headless(SIZE.0, SIZE.1)
    }))
}

/// Linear light of a display value.
fn decoded(value: f32) -> f32 {
    match value > 0.04045 {
        true => ((value + 0.055) / 1.055).powf(2.4),
        false => value / 12.92,
    }
}

/// SMPTE ST 2084.
fn perceptual(light: f32) -> f32 {
    let p = (light / 10000.0).powf(2610.0 / 16384.0);
    let (c1, c2, c3) = (3424.0 / 4096.0, 2413.0 / 128.0, 2392.0 / 128.0);
    ((c1 + c2 * p) / (1.0 + c3 * p)).powf(2523.0 / 32.0)
}

/// A frame filled with a colour.
fn filled(rgb: [u8; 3]) -> UiFrame {
    let [r, g, b] = rgb;
    let (width, height) = (SIZE.0 as f32, SIZE.1 as f32);
    let corners = [
        Vec2::ZERO,
        Vec2::new(width, 0.0),
        Vec2::new(width, height),
        Vec2::new(0.0, height),
    ];
    UiFrame {
        textures: vec![UiTexture {
            id: 1,
            width: 1,
            height: 1,
            rgba: vec![255; 4],
        }],
        dropped: Vec::new(),
        meshes: vec![UiMesh {
            texture: 1,
            clip: [Vec2::ZERO, corners[2]],
            vertices: corners
                .map(|position| UiVertex {
                    position,
                    st: Vec2::splat(0.5),
                    rgba: [r, g, b, 255],
                })
                .to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
        }],
    }
}

/// What a window shows of a colour.
fn presented(renderer: &mut Renderer, rgb: [u8; 3]) -> [f32; 3] {
    renderer.begin_frame(0);
    renderer.draw_ui(filled(rgb)).unwrap();
    let shown = renderer.read_presented().unwrap();
    let picture = renderer.read_pixels().unwrap();
    assert_eq!(picture.rgb[..3], rgb, "a screenshot");
    renderer.end_frame().unwrap();
    assert_eq!(shown.len(), (SIZE.0 * SIZE.1) as usize);
    shown[shown.len() / 2]
}

#[test]
fn display_values_have_the_brightness_of_white_and_its_parts() {
    for choice in [HdrChoice::ScRgb, HdrChoice::Hdr10, HdrChoice::Any] {
        let Some(mut renderer) = renderer(choice) else {
            return;
        };
        let none: Arc<dyn GameFiles> = Arc::new(MemoryFiles::new());
        let settings = Settings {
            hdr_white: WHITE,
            ..Settings::default()
        };
        renderer.begin_registration(none, &settings).unwrap();
        for grey in [0, 64, 128, 255] {
            let light = decoded(f32::from(grey) / 255.0) * WHITE;
            let expected = match choice {
                HdrChoice::ScRgb => light / 80.0,
                _ => perceptual(light),
            };
            let found = presented(&mut renderer, [grey; 3]);
            for channel in found {
                // half floats, and a matrix of four digits
                let error = (channel - expected).abs();
                assert!(
                    error < 2e-3 * expected.max(0.1),
                    "{choice:?} {grey}: {found:?} {expected}"
                );
            }
        }
        // red of Rec. 709 is inside of Rec. 2020: all three channels
        let red = presented(&mut renderer, [255, 0, 0]);
        let expected = match choice {
            HdrChoice::ScRgb => [WHITE / 80.0, 0.0, 0.0],
            _ => [0.6274, 0.0691, 0.0164].map(|part| perceptual(part * WHITE)),
        };
        for (found, expected) in red.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 5e-3,
                "{choice:?}: {red:?} {expected:?}"
            );
        }
        assert!(renderer.validation_messages().is_empty());
    }
}

/// Frames of the sample's first spawn point; the picture and what a window shows.
fn traced(hdr: HdrChoice) -> Option<(Picture, Vec<[f32; 3]>)> {
    let mut renderer = renderer(hdr)?;
    let settings = Settings {
        rt: Look::Traced,
        rt_accumulate: true,
        rt_bounces: 0,
        rt_exposure: 3.0,
        hdr_white: WHITE,
        hdr_peak: PEAK,
        ..Settings::full_size()
    };
    let def = load_sample(&mut renderer, &settings, SIZE);
    for _ in 0..2 {
        frame(&mut renderer, &def);
    }
    let shown = renderer.read_presented().unwrap();
    let picture = renderer.read_pixels().unwrap();
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "{messages:?}");
    Some((picture, shown))
}

#[test]
fn bright_light_exceeds_white_up_to_the_peak_and_the_rest_stays() {
    let (Some((plain, none)), Some((wide, shown))) =
        (traced(HdrChoice::Off), traced(HdrChoice::ScRgb))
    else {
        return;
    };
    assert!(none.is_empty());
    let brightest = shown.iter().flatten().fold(0.0f32, |a, b| a.max(*b)) * 80.0;
    assert!(brightest > WHITE * 1.2, "{brightest} cd/m²");
    assert!(brightest <= PEAK * 1.01, "{brightest} cd/m²");
    // below the knee of the tone curve both pictures are alike
    let mut compared = 0;
    for (a, b) in plain.rgb.iter().zip(&wide.rgb) {
        if *a < 180 {
            assert!(a.abs_diff(*b) <= 1, "{a} {b}");
            compared += 1;
        }
    }
    assert!(compared * 4 > plain.rgb.len(), "{compared} values");
}
