//! Light that the second eye of a stereo picture takes from the first.

use glam::Vec3;

use super::harness::{Gpu, gpu_tests};
use super::screen_hits::{lit_hall, on_screen};
use crate::settings::{Anaglyph, Settings};

gpu_tests! {
    compute: [
        the_second_eye_takes_over_the_light_of_the_first,
        the_corners_of_the_picture_need_fewer_rays,
    ],
}

fn stereo(share: bool) -> Settings {
    Settings {
        rt_bounce_screen: 0,
        rt_bounce_adaptive: 16,
        rt_share_eyes: share,
        anaglyph: Anaglyph::RedCyan,
        stereo_separation: 16.0,
        convergence: 100.0,
        ..on_screen(1)
    }
}

/// Root mean square difference, red, over the mean.
fn error(picture: &[Vec3], truth: &[Vec3]) -> f32 {
    let squares: f32 = picture
        .iter()
        .zip(truth)
        .map(|(a, b)| (a.x - b.x).powi(2))
        .sum();
    let mean = truth.iter().map(|p| p.x).sum::<f32>() / truth.len() as f32;
    (squares / truth.len() as f32).sqrt() / mean
}

fn the_second_eye_takes_over_the_light_of_the_first(gpu: &mut Gpu) {
    let mut scene = lit_hall();
    (scene.def.width, scene.def.height) = (96, 96);
    let frames = 48;
    let rested = gpu.render_eyes(&scene, &stereo(false), frames, false);
    let exact = Settings {
        rt_accumulate: true,
        ..stereo(false)
    };
    let truth = gpu
        .render_eyes(&scene, &exact, 512, false)
        .pop()
        .expect("a frame")
        .0;
    let mut last = |share, forgets| {
        gpu.render_eyes(&scene, &stereo(share), frames, forgets)
            .pop()
            .expect("a frame")
    };
    let (alone, alone_rays) = last(false, true);
    let (shared, shared_rays) = last(true, true);
    let (kept, kept_rays) = last(true, false);
    let errors = [&alone, &shared, &kept, &rested[47].0].map(|picture| error(picture, &truth));
    println!(
        "errors {errors:?}, rays {alone_rays} {shared_rays} {kept_rays} {}",
        rested[47].1
    );
    // Without a history of its own: the noise above the error of the filter, which all frames have.
    let noise = |error: f32| error * error - errors[3] * errors[3];
    assert!(noise(errors[1]) < 0.4 * noise(errors[0]), "{errors:?}");
    assert!(shared_rays * 2 < alone_rays, "{shared_rays} {alone_rays}");
    // with one: nothing is lost
    assert!(errors[2] < 1.05 * errors[3], "{errors:?}");
    let mean = |picture: &[Vec3]| picture.iter().map(|p| p.x).sum::<f32>();
    assert!((mean(&kept) / mean(&truth) - 1.0).abs() < 0.01);
    assert!((mean(&shared) / mean(&truth) - 1.0).abs() < 0.01);
}

fn the_corners_of_the_picture_need_fewer_rays(gpu: &mut Gpu) {
    let mut scene = lit_hall();
    (scene.def.width, scene.def.height) = (96, 96);
    // rays of a frame whose history is a few frames long
    let [all, some] = [0.0, 1.0].map(|foveation| {
        let settings = Settings {
            rt_foveation: foveation,
            rt_bounce_adaptive: 28,
            ..stereo(false)
        };
        gpu.render_eyes(&scene, &settings, 60, false)
    });
    let rays = |frames: &[(Vec<Vec3>, u64)]| frames.iter().map(|(_, rays)| rays).sum::<u64>();
    println!("{} {}", rays(&some), rays(&all));
    assert!(rays(&some) * 20 < rays(&all) * 17);
    let mean = |frames: &[(Vec<Vec3>, u64)]| {
        frames[30..]
            .iter()
            .flat_map(|(p, _)| p)
            .map(|p| p.x)
            .sum::<f32>()
    };
    assert!((mean(&some) / mean(&all) - 1.0).abs() < 0.01);
}
