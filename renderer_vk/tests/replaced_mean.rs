//! A picture in place of the mean of accumulated frames, as filters give it.
//!
//! Without a device the test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

mod common;

use common::{frame, load_sample};
use renderer_vk::api::RefDef;
use renderer_vk::{Look, Renderer, RendererOptions, Settings};

const SIZE: (u32, u32) = (64, 36);

#[test]
fn frames_show_the_given_mean_and_keep_it_until_their_content_changes() {
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(SIZE.0, SIZE.1)
    };
    let Some(mut renderer) = testkit::device(Renderer::new(options)) else {
        return;
    };
    let settings = Settings {
        rt: Look::Traced,
        rt_accumulate: true,
        rt_bounces: 0,
        rt_bloom: 0.0,
        rt_auto_exposure: false,
        ..Settings::full_size()
    };
    let def = load_sample(&mut renderer, &settings, SIZE);
    let pixels = (SIZE.0 * SIZE.1) as usize;
    // black on the left, white on the right
    let given: Vec<[f32; 3]> = (0..pixels)
        .map(|at| [if at % 64 < 32 { 0.0 } else { 50.0 }; 3])
        .collect();
    assert!(!renderer.replace_radiance(&given).unwrap(), "no frame yet");
    frame(&mut renderer, &def);
    let traced = renderer.read_radiance().unwrap();
    renderer.replace_radiance(&given[1..]).unwrap_err();
    assert!(renderer.replace_radiance(&given).unwrap());
    for _ in 0..3 {
        frame(&mut renderer, &def);
        for (found, given) in renderer.read_radiance().unwrap().iter().zip(&given) {
            assert!((found[1] - given[1]).abs() < 1.0e-3, "{found:?} {given:?}");
        }
    }
    let shown = renderer.read_pixels().unwrap().rgb;
    for (at, rgb) in shown.chunks_exact(3).enumerate() {
        let white = at % 64 >= 32;
        assert!(
            if white { rgb[1] > 250 } else { rgb[1] == 0 },
            "{at}: {rgb:?}"
        );
    }
    // other content: a mean of its own
    let turned = RefDef {
        time_ms: 1000,
        ..def
    };
    frame(&mut renderer, &turned);
    let again = renderer.read_radiance().unwrap();
    let mean = |picture: &[[f32; 3]]| picture.iter().map(|p| p[1]).sum::<f32>() / pixels as f32;
    let (before, after) = (mean(&traced), mean(&again));
    assert!((after - before).abs() < 0.2 * before, "{before} {after}");
    renderer.set_settings(&Settings {
        rt_accumulate: false,
        ..settings
    });
    frame(&mut renderer, &def);
    assert!(!renderer.replace_radiance(&given).unwrap(), "no mean");
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "{messages:?}");
}
