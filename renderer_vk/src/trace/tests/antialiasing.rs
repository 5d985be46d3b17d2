//! Temporal antialiasing, upscaling and depth of field, compared with pictures of many samples per pixel.

use glam::{Mat3, Vec3};
use relight::compare::{Rgb8, compare};
use shaders::types::Dielectric;
use shaders::types::constants as c;

use super::dielectrics::{LIQUID, square};
use super::harness::{Gpu, Scene, identity, mirror_at, rectangle, reference, stage};
use crate::api::RefDef;
use crate::scene::TracedScene;
use crate::settings::{DenoiserChoice, Settings};
use crate::trace::tracer::Tracer;

const SIZE: i32 = 64;
/// Frames accumulated for a reference picture: its standard error is one sixteenth of a single sample's.
const TRUTH: u32 = 256;

pub(super) fn live() -> Settings {
    Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::None,
        ..reference()
    }
}

fn plain() -> Settings {
    Settings {
        rt_taa: false,
        ..live()
    }
}

fn picture(pixels: &[[u8; 4]]) -> Rgb8 {
    let rgb = pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect();
    Rgb8::new(SIZE as usize, SIZE as usize, rgb).expect("a picture")
}

fn ssim(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    compare(&picture(a), &picture(b)).expect("compared").ssim
}

/// Root mean square difference of display values, 0..255.
fn error(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let difference = compare(&picture(a), &picture(b)).expect("compared");
    difference.root_mean_square
}

/// A floor of black and white squares at a grazing angle, with a few poles. All surfaces are emissive, so that only
/// edges are noisy.
pub(super) fn checkerboard() -> Scene {
    let mut scene = Scene::new(
        Vec3::new(-150.0, 20.0, 70.0),
        Vec3::new(60.0, 0.0, -10.0),
        60.0,
        SIZE,
    );
    let white = scene.material(&[stage::constant([0.9; 3])], 0);
    let black = scene.material(&[stage::constant([0.1; 3])], 0);
    let grey = scene.material(&[stage::constant([0.4, 0.5, 0.6])], 0);
    scene.room(Vec3::splat(-1000.0), Vec3::splat(1000.0), grey);
    for i in -4..6 {
        for k in -5..5 {
            let corner = Vec3::new(i as f32 * 30.0, k as f32 * 30.0, 0.0);
            let material = if (i + k) % 2 == 0 { white } else { black };
            scene.quad(rectangle(corner, Vec3::X * 30.0, Vec3::Y * 30.0), material);
        }
    }
    for y in [-40.0, 10.0, 45.0] {
        let foot = Vec3::new(20.0 + y, y, 0.0);
        scene.quad(
            rectangle(foot, Vec3::new(5.0, 3.0, 60.0), Vec3::new(1.0, 5.0, 0.0)),
            white,
        );
    }
    scene
}

#[test]
fn temporal_antialiasing() {
    // one test, because compiling the pipelines takes longer than all of these; the results do not depend on the tracer
    let Some(mut gpu) = Gpu::new(Tracer::Compute) else {
        return;
    };
    at_rest_it_comes_to_the_mean_of_many_samples(&mut gpu);
    in_motion_it_stays_sharp(&mut gpu);
    moving_objects_leave_no_trail(&mut gpu);
    moving_emissive_surfaces_keep_their_brightness(&mut gpu);
    a_smaller_traced_picture_comes_to_the_full_one(&mut gpu);
    the_lens_blurs_by_its_circle_of_confusion(&mut gpu);
    both_sides_of_a_reflection_come_to_rest(&mut gpu);
    thin_geometry_does_not_flicker(&mut gpu);
    sharpening_raises_contrast_alone(&mut gpu);
    thin_geometry_keeps_its_history_in_motion(&mut gpu);
    a_mirror_shows_what_is_seen_from_behind_it(&mut gpu);
    ripples_leave_no_trail(&mut gpu);
}

fn at_rest_it_comes_to_the_mean_of_many_samples(gpu: &mut Gpu) {
    let scene = checkerboard();
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let (_, jagged) = gpu.render(&scene, &plain(), 1);
    let (_, settled) = gpu.render(&scene, &live(), 64);
    let (raw, now) = (error(&jagged, &truth), error(&settled, &truth));
    let alike = [&jagged, &settled].map(|p| ssim(p, &truth));
    println!("at rest: error {raw} without, {now} with; SSIM {alike:?}");
    assert!(now < 0.3 * raw, "{now} {raw}");
    assert!(alike[1] > 0.975, "{alike:?}");
    // no flicker
    let (_, next) = gpu.render(&scene, &live(), 65);
    let flicker = error(&settled, &next);
    println!("from frame to frame: {flicker}");
    assert!(flicker < 0.15 * raw, "{flicker} {raw}");
}

/// The reflection in a shiny floor is far behind it, so that its pixels alternate between a short and a long view
/// distance.
fn both_sides_of_a_reflection_come_to_rest(gpu: &mut Gpu) {
    let mut scene = checkerboard();
    let around = square(gpu, 1, &[128, 128, 128, 255]);
    scene.images.push(around.texture_index());
    let shine = stage::shine(0);
    for i in 0..8 {
        let grey = [0.1, 0.9][i % 2];
        let shiny = scene.material(&[stage::constant([grey; 3]), shine], 0);
        let corner = Vec3::new(-120.0 + i as f32 * 28.0, -150.0, 1.0);
        scene.quad(rectangle(corner, Vec3::X * 28.0, Vec3::Y * 300.0), shiny);
    }
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let (_, jagged) = gpu.render(&scene, &plain(), 1);
    let (_, settled) = gpu.render(&scene, &live(), 64);
    let (_, next) = gpu.render(&scene, &live(), 65);
    let [raw, now] = [&jagged, &settled].map(|p| error(p, &truth));
    let flicker = error(&settled, &next);
    println!(
        "a shiny floor at rest: error {raw} without, {now} with; from frame to frame {flicker}"
    );
    assert!(now < 0.4 * raw, "{now} {raw}");
    assert!(flicker < 0.25 * raw, "{flicker} {raw}");
}

fn in_motion_it_stays_sharp(gpu: &mut Gpu) {
    let scene = checkerboard();
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let (_, jagged) = gpu.render(&scene, &plain(), 1);
    let (_, moved) = gpu.render_path(&scene, &live(), 48, |frame, def| {
        walk(def, &scene.def, 47.0 - frame as f32);
    });
    let (raw, now) = (error(&jagged, &truth), error(&moved, &truth));
    let alike = [&jagged, &moved].map(|p| ssim(p, &truth));
    println!("moving: error {raw} without, {now} with; SSIM {alike:?}");
    assert!(now < 0.55 * raw, "{now} {raw}");
    assert!(alike[1] > alike[0] && alike[1] > 0.945, "{alike:?}");
}

/// Camera position `left` frames before it arrives.
pub(super) fn walk(def: &mut RefDef, arrived: &RefDef, left: f32) {
    def.view_origin = arrived.view_origin + Vec3::new(-0.9, 0.6, 0.2) * left;
    let turn = Mat3::from_rotation_z(0.004 * left);
    def.view_axis = arrived.view_axis.map(|v| turn * v);
}

/// A camera in front of a mirror has, with left and right exchanged, the picture of the mirrored camera without the
/// mirror.
fn a_mirror_shows_what_is_seen_from_behind_it(gpu: &mut Gpu) {
    const MIRROR: f32 = -130.0;
    let scene = checkerboard();
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let (frames, last) = (24, 23.0);
    let (_, directly) = gpu.render_path(&scene, &live(), frames, |frame, def| {
        walk(def, &scene.def, last - frame as f32);
    });
    let mut mirrored = checkerboard();
    let mirror = mirrored.material(&[stage::filter([1.0; 3])], c::MATERIAL_PORTAL);
    let corner = Vec3::new(MIRROR, -900.0, -900.0);
    let shape = rectangle(corner, Vec3::Y * 1800.0, Vec3::Z * 1800.0);
    mirrored.quad(shape, mirror);
    mirrored.portals.push(mirror_at(MIRROR, Vec3::X));
    let (_, by_mirror) = gpu.render_path(&mirrored, &live(), frames, |frame, def| {
        walk(def, &scene.def, last - frame as f32);
        def.view_origin.x = 2.0 * MIRROR - def.view_origin.x;
        for axis in &mut def.view_axis {
            axis.x = -axis.x;
        }
    });
    let [off, blur] = [&by_mirror, &truth].map(|p| error(&directly, p));
    println!("in a mirror: error {off}, where that of either picture is {blur}");
    assert!(off < 0.2 * blur, "{off} {blur}");
}

/// Water with ripples over a floor of squares.
pub(super) fn rippled() -> Scene {
    let mut scene = checkerboard();
    let water = scene.material(&[stage::filter([1.0; 3])], LIQUID);
    scene.materials[water as usize].0.dielectric = Dielectric {
        index: 1.33,
        scale: 1.0,
        ripple: 0.05,
        ..Dielectric::default()
    };
    let corner = Vec3::new(-600.0, -600.0, 40.0);
    let shape = rectangle(corner, Vec3::X * 1200.0, Vec3::Y * 1200.0);
    scene.quad(shape, water);
    scene
}

/// Moving ripples, with a moving camera and with a static one.
fn ripples_leave_no_trail(gpu: &mut Gpu) {
    let scene = rippled();
    let (frames, last) = (24, 23.0);
    let run = |view: &mut TracedScene, left: f32| {
        view.time = 7.0 - 0.016 * left;
        view.instances[0].time = view.time;
    };
    let (_, truth) = gpu.render_views(&scene, &reference(), TRUTH, |_, view| run(view, 0.0));
    let (_, jagged) = gpu.render_views(&scene, &plain(), 1, |_, view| run(view, 0.0));
    for (moves, most) in [(1.0, 0.69), (0.0, 0.65)] {
        let (_, seen) = gpu.render_views(&scene, &live(), frames, |frame, view| {
            let left = last - frame as f32;
            run(view, left);
            walk(&mut view.def, &scene.def, left * moves);
        });
        let (raw, now) = (error(&jagged, &truth), error(&seen, &truth));
        let alike = [&jagged, &seen].map(|p| ssim(p, &truth));
        println!("ripples, camera moves {moves}: error {raw} without, {now} with; SSIM {alike:?}");
        assert!(now < most * raw, "{now} {raw}");
    }
}

fn moving_objects_leave_no_trail(gpu: &mut Gpu) {
    let mut scene = checkerboard();
    let red = scene.material(&[stage::constant([0.9, 0.1, 0.1])], 0);
    let from = Vec3::new(-40.0, 40.0, 20.0);
    let shape = rectangle(Vec3::ZERO, Vec3::Z * 30.0, Vec3::Y * 30.0);
    scene.mesh(shape, red, identity());
    let at = |frame: f32| from - Vec3::Y * (5.0 * frame);
    let place = |frame: f32, view: &mut TracedScene| {
        view.time = frame * 0.02;
        view.instances.last_mut().expect("placed").origin = at(frame);
        view.look.entities[0].origin = at(frame);
    };
    let last = 14;
    let (_, truth) = gpu.render_views(&scene, &reference(), TRUTH, |_, view| {
        place(last as f32, view);
    });
    let (_, jagged) = gpu.render_views(&scene, &plain(), 1, |_, view| place(last as f32, view));
    let (_, moved) = gpu.render_views(&scene, &live(), last + 1, |frame, view| {
        place(frame as f32, view);
    });
    let (raw, now) = (error(&jagged, &truth), error(&moved, &truth));
    println!("a thing that moves: error {raw} without, {now} with");
    assert!(now < 0.6 * raw, "{now} {raw}");
    // no red remains where the object was, and the object does not show the floor
    let redness = |p: &[u8; 4]| i32::from(p[0]) - i32::from(p[1]);
    let wrong = |p: &[[u8; 4]]| {
        let pairs = p.iter().zip(&truth);
        pairs
            .filter(|(a, b)| (redness(a) - redness(b)).abs() > 60)
            .count()
    };
    let counts = [wrong(&jagged), wrong(&moved)];
    println!("pixels of the wrong colour: {counts:?}");
    assert!(counts[1] <= counts[0], "{counts:?}");
}

fn moving_emissive_surfaces_keep_their_brightness(gpu: &mut Gpu) {
    // a thin bright line in the air before a static wall, whose history must not suppress it
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let wall = scene.material(&[stage::constant([0.2; 3])], 0);
    scene.room(Vec3::splat(-300.0), Vec3::splat(300.0), wall);
    let glow = scene.material(
        &[stage::add([0.9, 0.2, 0.1])],
        c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
    );
    // two pixels wide, so that each frame has equally many samples on it, at any position
    let width = 2.0 * 2.0 * 100.0 * 30f32.to_radians().tan() / SIZE as f32;
    let corner = Vec3::new(100.0, -0.5 * width, -45.0);
    let shape = rectangle(corner, Vec3::Z * 90.0, Vec3::Y * width);
    scene.mesh(shape, glow, identity());
    let (still, _) = gpu.render(&scene, &reference(), 64);
    let line = |pixels: &[Vec3]| -> f32 { pixels.iter().map(|p| p.x - p.z).sum() };
    let (frames, first) = (24, 8);
    for speed in [0.0, 2.3, -7.1] {
        let place = |frame: u32, view: &mut TracedScene| {
            let at = Vec3::Y * (speed * (frame as f32 - 16.0));
            view.time = frame as f32 * 0.02;
            view.instances.last_mut().expect("placed").origin = at;
            view.look.entities[0].origin = at;
        };
        let mut sum = 0.0;
        let mut watch = |frame: u32, pixels: &[Vec3]| {
            if frame >= first {
                sum += line(pixels);
            }
        };
        gpu.render_watched(&scene, &live(), frames, place, Some(&mut watch));
        let ratio = sum / ((frames - first) as f32 * line(&still));
        println!("a line that moves {speed} units a frame: {ratio} of its light");
        assert!((ratio - 1.0).abs() < 0.15, "{speed}: {ratio}");
    }
}

fn a_smaller_traced_picture_comes_to_the_full_one(gpu: &mut Gpu) {
    let scene = checkerboard();
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let half = |settings: Settings| Settings {
        rt_scale: 0.5,
        ..settings
    };
    let (_, upscaled) = gpu.render(&scene, &half(plain()), 1);
    let (_, settled) = gpu.render(&scene, &half(live()), 96);
    // bilinear interpolation, as a texture unit computes it
    let (_, small) = gpu.render(&half_size(&scene), &plain(), 1);
    let bilinear = bilinear(&small);
    let alike = [&bilinear, &upscaled, &settled].map(|p| ssim(p, &truth));
    println!("half the size: SSIM bilinear, upscaled, over time {alike:?}");
    assert!(alike[1] > alike[0], "{alike:?}");
    assert!(alike[2] > alike[0] + 0.35 * (1.0 - alike[0]), "{alike:?}");
    assert!(alike[2] > 0.85, "{alike:?}");
    // a size that is no multiple of the traced one
    let odd = |settings: Settings| Settings {
        rt_scale: 0.27,
        ..settings
    };
    let (_, upscaled) = gpu.render(&scene, &odd(plain()), 1);
    let (_, settled) = gpu.render(&scene, &odd(live()), 128);
    let alike = [&upscaled, &settled].map(|p| ssim(p, &truth));
    println!("0.27 of the size: SSIM upscaled, over time {alike:?}");
    assert!(alike[1] > alike[0], "{alike:?}");
}

fn half_size(scene: &Scene) -> Scene {
    let mut small = checkerboard();
    small.def = scene.def;
    small.def.width /= 2;
    small.def.height /= 2;
    small
}

/// A picture twice as large.
fn bilinear(small: &[[u8; 4]]) -> Vec<[u8; 4]> {
    let half = SIZE / 2;
    let at = |x: i32, y: i32| small[(y.clamp(0, half - 1) * half + x.clamp(0, half - 1)) as usize];
    let mut out = Vec::new();
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (u, v) = ((x as f32 - 0.5) * 0.5, (y as f32 - 0.5) * 0.5);
            let (i, k) = (u.floor(), v.floor());
            out.push(std::array::from_fn(|c| {
                let value = |dx, dy| f32::from(at(i as i32 + dx, k as i32 + dy)[c]);
                let above = value(0, 0) + (value(1, 0) - value(0, 0)) * (u - i);
                let below = value(0, 1) + (value(1, 1) - value(0, 1)) * (u - i);
                (above + (below - above) * (v - k)).round() as u8
            }));
        }
    }
    out
}

fn the_lens_blurs_by_its_circle_of_confusion(gpu: &mut Gpu) {
    // a vertical edge between white and black at distance 400, for several focus distances
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 10.0, SIZE);
    let white = scene.material(&[stage::constant([1.0; 3])], 0);
    let black = scene.material(&[stage::constant([0.0; 3])], 0);
    let distance = 400.0;
    for (y, material) in [(0.0, white), (-500.0, black)] {
        let corner = Vec3::new(distance, y, -500.0);
        scene.quad(
            rectangle(corner, Vec3::Z * 1000.0, Vec3::Y * 500.0),
            material,
        );
    }
    let aperture = 40.0;
    for focus in [distance, 250.0, 800.0] {
        let settings = Settings {
            rt_dof: true,
            rt_aperture: aperture,
            rt_focal_length: focus,
            ..reference()
        };
        let (pixels, _) = gpu.render(&scene, &settings, 192);
        // radius of the circle of confusion, in the plane of the edge
        let radius = 0.5 * aperture * (distance - focus).abs() / focus;
        for x in 0..SIZE {
            let column = (0..SIZE).map(|y| pixels[(y * SIZE + x) as usize].x);
            let found = column.sum::<f32>() / SIZE as f32;
            let tan = 5.0f32.to_radians().tan();
            let y = -((x as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0) * tan * distance;
            if radius == 0.0 {
                // sharp except for the column of the edge
                let wanted = if y > 0.0 { 1.0 } else { 0.0 };
                assert!((found - wanted).abs() < 1.0e-3, "{x}: {found} {wanted}");
                continue;
            }
            // part of the disc beyond the edge
            let h = (y / radius).clamp(-1.0, 1.0);
            let wanted = 0.5 + (h.asin() + h * (1.0 - h * h).sqrt()) / std::f32::consts::PI;
            assert!(
                (found - wanted).abs() < 0.02,
                "focus {focus}, column {x}: {found}, not {wanted}"
            );
        }
    }
}

/// Poles of one pixel's width, far before a wall: the wall around them was hidden by them in the last frame.
fn thin_geometry_keeps_its_history_in_motion(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let wall = scene.material(&[stage::constant([0.1; 3])], 0);
    let pole = scene.material(&[stage::constant([0.9; 3])], c::MATERIAL_TWO_SIDED);
    scene.room(Vec3::splat(-600.0), Vec3::splat(600.0), wall);
    let pixel = 2.0 * 100.0 * 30f32.to_radians().tan() / SIZE as f32;
    for i in -6..7 {
        let corner = Vec3::new(100.0, (i as f32 * 5.3 + 0.4) * pixel, -90.0);
        let shape = rectangle(corner, Vec3::Z * 180.0, Vec3::Y * pixel);
        scene.quad(shape, pole);
    }
    // to the side by one pixel per frame: each frame is the previous one, shifted by a column
    let (first, last) = (12, 24);
    let mut frames: Vec<Vec<Vec3>> = Vec::new();
    let mut watch = |frame: u32, pixels: &[Vec3]| {
        if frame >= first {
            frames.push(pixels.to_vec());
        }
    };
    let walk = |frame: u32, view: &mut TracedScene| {
        view.def.view_origin = scene.def.view_origin + Vec3::Y * (pixel * frame as f32);
    };
    gpu.render_watched(&scene, &live(), last, walk, Some(&mut watch));
    let (mut sum, mut count) = (0.0, 0.0);
    for pair in frames.windows(2) {
        for i in 0..pair[0].len() - 1 {
            if (i + 1) % SIZE as usize != 0 {
                sum += (pair[1][i + 1].x - pair[0][i].x).powi(2);
                count += 1.0;
            }
        }
    }
    let shimmer = (sum / count).sqrt();
    println!("thin poles in motion change by {shimmer} from frame to frame");
    // 0.083 without that history
    assert!(shimmer < 0.06, "{shimmer}");
}

/// Wires thinner than a pixel, far before a wall: the samples of most frames miss them.
fn thin_geometry_does_not_flicker(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let wall = scene.material(&[stage::constant([0.1; 3])], 0);
    let wire = scene.material(&[stage::constant([0.9; 3])], c::MATERIAL_TWO_SIDED);
    scene.room(Vec3::splat(-600.0), Vec3::splat(600.0), wall);
    let pixel = 2.0 * 100.0 * 30f32.to_radians().tan() / SIZE as f32;
    for i in -4..5 {
        let corner = Vec3::new(100.0, (i as f32 * 6.3 + 0.4) * pixel, -90.0);
        let shape = rectangle(corner, Vec3::Z * 180.0, Vec3::Y * (0.12 * pixel));
        scene.quad(shape, wire);
    }
    let (_, truth) = gpu.render(&scene, &reference(), TRUTH);
    let (first, last) = (48, 96);
    let mut frames: Vec<Vec<Vec3>> = Vec::new();
    let mut watch = |frame: u32, pixels: &[Vec3]| {
        if frame >= first {
            frames.push(pixels.to_vec());
        }
    };
    let (_, settled) = gpu.render_watched(&scene, &live(), last, |_, _| {}, Some(&mut watch));
    // largest excess of a pixel in one frame over the mean
    let count = frames.len() as f32;
    let mut flash = 0.0f32;
    for i in 0..truth.len() {
        let values = || frames.iter().filter_map(|f| f.get(i)).map(|p| p.x);
        let mean = values().sum::<f32>() / count;
        flash = flash.max(values().fold(0.0, f32::max) - mean);
    }
    let off = error(&settled, &truth);
    println!("thin wires: error {off}, brightest flash {flash}");
    assert!(flash < 0.15, "{flash}");
}

/// Sharpening raises the contrast of neighbouring pixels, makes no negative colour, and leaves even areas as they are.
fn sharpening_raises_contrast_alone(gpu: &mut Gpu) {
    let traced = |gpu: &mut Gpu, scene: &Scene, rt_sharpness: f32| {
        let settings = Settings {
            rt_scale: 0.5,
            rt_sharpness,
            ..plain()
        };
        gpu.render(scene, &settings, 2).0
    };
    let board = checkerboard();
    let (soft, sharp) = (traced(gpu, &board, 0.0), traced(gpu, &board, 1.0));
    let contrast = |pixels: &[Vec3]| {
        let rows = pixels.chunks_exact(SIZE as usize);
        rows.flat_map(|row| row.windows(2).map(|w| (w[1].y - w[0].y).abs()))
            .sum::<f32>()
    };
    let ratio = contrast(&sharp) / contrast(&soft);
    println!("sharpened: contrast {ratio}");
    assert!(ratio > 1.15, "{ratio}");
    assert!(
        sharp.iter().all(|p| p.cmpge(Vec3::ZERO).all()),
        "negative colours"
    );
    let mut even = Scene::new(Vec3::ZERO, Vec3::X, 60.0, SIZE);
    let wall = even.material(&[stage::constant([0.7, 0.2, 0.4])], 0);
    even.room(Vec3::splat(-100.0), Vec3::splat(100.0), wall);
    let (soft, sharp) = (traced(gpu, &even, 0.0), traced(gpu, &even, 1.0));
    for (a, b) in soft.iter().zip(&sharp) {
        assert!((*a - *b).abs().max_element() < 0.005, "{a} {b}");
    }
}
