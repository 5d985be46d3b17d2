//! Variants of temporal antialiasing: smoothed maximum of its colour range, more samples where the history is lost.

use glam::Vec3;
use shaders::trace_types::constants::COUNT_MORE_SAMPLES;

use super::antialiasing::{checkerboard, live, rippled, walk};
use super::harness::{Gpu, Scene, gpu_tests, identity, rectangle, reference, stage, switch_dlight};
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, Settings};

gpu_tests! {
    any: [
        lost_pixels_get_more_samples,
    ],
    compute: [
        a_smooth_maximum_calms_ripples,
        a_smooth_maximum_keeps_what_rests,
        a_smooth_maximum_lets_light_go_out,
        lit_pixels_get_more_samples,
    ],
}

/// Frames of a game with this weight of the last maximum.
fn smooth(kept: f32) -> Settings {
    Settings {
        rt_taa_maximum: kept,
        ..live()
    }
}

/// Pictures of the frames from `first` to the last.
fn pictures(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    [first, frames]: [u32; 2],
    change: impl Fn(u32, &mut TracedScene),
) -> Vec<Vec<Vec3>> {
    let mut all = Vec::new();
    let mut keep = |frame, pixels: &[Vec3]| {
        if frame >= first {
            all.push(pixels.to_vec());
        }
    };
    gpu.render_watched(scene, settings, frames, change, Some(&mut keep));
    all
}

/// Mean of the pixels, red.
fn mean(picture: &[Vec3]) -> f32 {
    picture.iter().map(|p| p.x).sum::<f32>() / picture.len() as f32
}

/// Mean squared difference of two pictures, red.
fn squares(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (b.x - a.x).powi(2))
        .sum::<f32>()
        / a.len() as f32
}

/// Change from one picture to the next.
fn change([a, b]: [&[Vec3]; 2]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| *b - *a).collect()
}

/// Ripples: change from frame to frame that the reference lacks, error of a frame, mean over that of the reference.
fn ripples(
    gpu: &mut Gpu,
    scene: &Scene,
    settings: &Settings,
    truth: &[Vec<Vec3>],
    place: impl Fn(u32, &mut TracedScene),
) -> [f32; 3] {
    let last = FRAMES[1] - truth.len() as u32;
    let seen = pictures(gpu, scene, settings, [last, FRAMES[1]], place);
    let pairs = |n: usize| seen.windows(n).zip(truth.windows(n));
    let flicker: f32 = pairs(2)
        .map(|(s, t)| squares(&change([&s[0], &s[1]]), &change([&t[0], &t[1]])))
        .sum();
    let error: f32 = pairs(1).map(|(s, t)| squares(&s[0], &t[0])).sum();
    let means = [&seen[..], truth].map(|all| all.iter().map(|p| mean(p)).sum::<f32>());
    let count = truth.len() as f32;
    [
        (flicker / (count - 1.0)).sqrt(),
        (error / count).sqrt(),
        means[0] / means[1],
    ]
}

const DENOISERS: [DenoiserChoice; 2] = [DenoiserChoice::None, DenoiserChoice::ASvgf];

/// First frame that is compared, and number of frames.
const FRAMES: [u32; 2] = [24, 32];

fn a_smooth_maximum_calms_ripples(gpu: &mut Gpu) {
    for (moves, sparkles) in [(0.0, false), (1.0, false), (0.0, true), (1.0, true)] {
        let mut scene = rippled();
        if sparkles {
            let white = scene.diffuse(1.0);
            for i in 0..6 {
                let corner = Vec3::new(40.0 + 40.0 * i as f32, -60.0 + 25.0 * i as f32, 200.0);
                scene.quad(rectangle(corner, Vec3::Y * 12.0, Vec3::X * 12.0), white);
            }
            scene.point(Vec3::new(140.0, 0.0, 100.0), 400_000.0, 0.1);
        }
        let place = |frame: u32, view: &mut TracedScene| {
            let left = FRAMES[1] as f32 - frame as f32;
            view.time = 7.0 - 0.016 * left;
            view.instances[0].time = view.time;
            walk(&mut view.def, &scene.def, left * moves);
        };
        let truth: Vec<Vec<Vec3>> = (FRAMES[0]..FRAMES[1])
            .map(|frame| {
                gpu.render_views(&scene, &reference(), 64, |_, view| place(frame, view))
                    .0
            })
            .collect();
        let mut before = [0.0; 3];
        for kept in [0.0, 0.5, 0.8] {
            let now = ripples(gpu, &scene, &smooth(kept), &truth, place);
            println!(
                "sparkles {sparkles}, camera moves {moves}, {kept}: flicker, error, mean {now:?}"
            );
            if kept == 0.0 {
                before = now;
            }
            assert!(now[0] <= before[0], "{now:?} {before:?}");
            assert!((now[2] / before[2] - 1.0).abs() < 0.006, "{now:?}");
        }
    }
}

fn a_smooth_maximum_keeps_what_rests(gpu: &mut Gpu) {
    let scene = checkerboard();
    let (truth, _) = gpu.render(&scene, &reference(), 256);
    let [usual, smoothed] = [0.0, 0.9].map(|kept| {
        let (seen, _) = gpu.render(&scene, &smooth(kept), 64);
        (squares(&seen, &truth).sqrt(), mean(&seen) / mean(&truth))
    });
    println!("at rest: error and mean {usual:?}, smoothed {smoothed:?}");
    assert!(
        smoothed.0 < 1.1 * usual.0 && (smoothed.1 / usual.1 - 1.0).abs() < 0.01,
        "{smoothed:?}"
    );
}

/// The light of a hall after its only lamp went out, as a part of what it was.
fn a_smooth_maximum_lets_light_go_out(gpu: &mut Gpu) {
    let scene = Scene::hall(40.0, 0.6, 64);
    let lamp = |frame: u32, view: &mut TracedScene| {
        switch_dlight(view, Vec3::new(0.0, -60.0, 60.0), 400.0, frame < 24);
    };
    for (denoiser, kept) in DENOISERS
        .into_iter()
        .flat_map(|d| [(d, 0.0), (d, 0.5), (d, 0.8)])
    {
        let settings = Settings {
            rt_denoiser: denoiser,
            ..smooth(kept)
        };
        let seen = pictures(gpu, &scene, &settings, [23, 56], lamp);
        let left: Vec<f32> = seen.iter().map(|p| mean(p) / mean(&seen[0])).collect();
        println!("{denoiser:?}, {kept}: {:?}", &left[..12]);
        // the least that a bound leaves which falls by this factor in each frame
        for (frame, left) in left.iter().enumerate().skip(2) {
            assert!(
                *left < 1.2 * kept.powi(frame as i32) + 0.04,
                "{frame}: {left}"
            );
        }
    }
}

/// Rays for a pixel without history.
const RAYS: [u32; 5] = [0, 1, 2, 4, 8];

/// Frames before each picture that is looked at.
const MOVED: [u32; 4] = [8, 10, 12, 14];

/// Root mean square error of the pixels that the last frame samples again, for each of [`RAYS`], then the light of these
/// pixels over that of the reference, and their part of all.
fn of_lost_pixels(
    gpu: &mut Gpu,
    scene: &Scene,
    place: impl Fn(u32, &mut TracedScene),
    light: DenoiserChoice,
) -> ([f32; 5], [f32; 5], f32) {
    let mut seen = [const { Vec::new() }; 5];
    let (mut truth, mut pixels) = (Vec::new(), 0);
    for moved in MOVED {
        let (exact, _) = gpu.render_views(scene, &reference(), 256, |_, view| place(moved, view));
        let pictures = RAYS.map(|rt_taa_rays| {
            let settings = Settings {
                rt_taa_rays,
                rt_denoiser: light,
                ..live()
            };
            gpu.count_rays(rt_taa_rays > 0);
            let (picture, _) = gpu.render_views(scene, &settings, moved + 1, &place);
            picture
        });
        let rays = gpu.rays().expect("counted")[COUNT_MORE_SAMPLES as usize];
        assert!(rays > 0);
        gpu.count_rays(false);
        let samples = gpu.look.antialias.more_samples.as_ref().expect("traced");
        let samples = gpu.device.read_image(samples).expect("read");
        let samples: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&samples);
        let of = |picture: Vec<Vec3>| {
            let pixels = picture.into_iter().zip(&samples);
            pixels.filter(|(_, s)| s[3] != 0).map(|(p, _)| p)
        };
        truth.extend(of(exact));
        for (seen, picture) in seen.iter_mut().zip(pictures) {
            seen.extend(of(picture));
        }
        pixels += samples.len();
    }
    let errors = seen.each_ref().map(|s| squares(s, &truth).sqrt());
    let means = seen.each_ref().map(|s| mean(s) / mean(&truth));
    let part = truth.len() as f32 / pixels as f32;
    println!("{light:?}: error {errors:?}, light {means:?}; {part} of all pixels");
    (errors, means, part)
}

/// A thing before a floor of squares moves aside.
fn lost_pixels_get_more_samples(gpu: &mut Gpu) {
    let mut scene = checkerboard();
    let red = scene.material(&[stage::constant([0.9, 0.1, 0.1])], 0);
    let shape = rectangle(Vec3::ZERO, Vec3::Z * 40.0, Vec3::Y * 60.0);
    scene.mesh(shape, red, identity());
    let place = |frame: u32, view: &mut TracedScene| {
        let at = Vec3::new(-60.0, 60.0 - 7.0 * frame as f32, 10.0);
        view.time = frame as f32 * 0.02;
        view.instances.last_mut().expect("placed").origin = at;
        view.look.entities[0].origin = at;
    };
    let (errors, means, part) = of_lost_pixels(gpu, &scene, place, DenoiserChoice::None);
    assert!(part > 0.002 && part < 0.1, "{part}");
    assert!(errors[4] < 0.7 * errors[0], "{errors:?}");
    assert!((means[4] - 1.0).abs() < 0.05, "{means:?}");
}

/// The same in a lit hall, whose light comes from the pixels around.
fn lit_pixels_get_more_samples(gpu: &mut Gpu) {
    for light in DENOISERS {
        let mut scene = Scene::hall(40.0, 0.6, 64);
        scene.point(Vec3::new(-100.0, -100.0, 0.0), 6000.0, 4.0);
        let dark = scene.diffuse(0.1);
        for i in 0..8 {
            let corner = Vec3::new(-150.0 + 36.0 * i as f32, -140.0, -79.5);
            scene.quad(rectangle(corner, Vec3::X * 18.0, Vec3::Y * 280.0), dark);
        }
        let grey = scene.diffuse(0.3);
        let shape = rectangle(Vec3::ZERO, Vec3::Z * 60.0, Vec3::Y * 60.0);
        scene.mesh(shape, grey, identity());
        let place = |frame: u32, view: &mut TracedScene| {
            let at = Vec3::new(-60.0, 60.0 - 7.0 * frame as f32, -60.0);
            view.time = frame as f32 * 0.02;
            view.instances.last_mut().expect("placed").origin = at;
            view.look.entities[0].origin = at;
        };
        let (errors, means, _) = of_lost_pixels(gpu, &scene, place, light);
        assert!(errors[4] < 0.95 * errors[0], "{errors:?}");
        assert!((means[4] - 1.0).abs() < 0.05, "{means:?}");
    }
}
