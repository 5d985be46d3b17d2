//! Direct light compared with closed forms: edges, discs, furnaces, moving lights, the flashlight, and estimators.

use std::f32::consts::PI;

use glam::Vec3;
use shaders::types::{Instance, constants as c};

use super::harness::{
    Gpu, Scene, floor_at, floor_points, gpu_tests, identity, lambert, rectangle, reference, stage,
};
use crate::settings::{LightSelection, Settings};

gpu_tests! {
    any: [
        an_edge_hides_the_part_of_a_light_that_lies_behind_it,
        the_suns_disc_makes_a_penumbra_of_its_own_width,
        in_a_furnace_of_sky_a_white_floor_is_as_bright_as_the_sky,
        the_flashlight_lights_a_spot_before_the_camera,
        estimators_differ_by_noise_alone,
        a_tree_finds_each_light_from_within_its_nodes,
        a_chosen_ray_goes_where_it_was_sent,
        errors_fall_faster_than_those_of_independent_frames,
    ],
    each: [
        lights_of_a_brush_model_go_where_it_goes,
    ],
}

pub(super) const SIDE: usize = 32;

/// A white floor from above, `half` units to each side.
fn floor_from_above(half: f32) -> Scene {
    let height = 90.0;
    let fov = 2.0 * (half / height).atan().to_degrees();
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, height), Vec3::ZERO, fov, SIDE as i32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 900.0), white);
    scene
}

/// The same below a ceiling at a height of 150 units, above the camera, that covers x < 0.
fn floor_below_an_edge() -> Scene {
    let mut scene = floor_from_above(40.0);
    let white = scene.diffuse(1.0);
    let corner = Vec3::new(-900.0, -900.0, 150.0);
    scene.quad(rectangle(corner, Vec3::Y * 1800.0, Vec3::X * 900.0), white);
    scene
}

pub(super) fn all_lights() -> Settings {
    Settings {
        rt_num_random_dl: 0,
        rt_antialiasing: false,
        ..reference()
    }
}

/// 256 light samples a pixel, in few frames.
fn many_samples() -> (Settings, u32) {
    let settings = Settings {
        rt_num_random_dl: 64,
        ..all_lights()
    };
    (settings, 4)
}

/// The part of a polygon on the positive side of a plane.
fn clipped(polygon: &[Vec3], normal: Vec3, point: Vec3) -> Vec<Vec3> {
    let height = |p: Vec3| (p - point).dot(normal);
    let mut out = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            out.push(a);
        }
        if (ha < 0.0) != (hb < 0.0) {
            out.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    out
}

fn an_edge_hides_the_part_of_a_light_that_lies_behind_it(gpu: &mut Gpu) {
    let triangle = [
        Vec3::new(-40.0, -30.0, 300.0),
        Vec3::new(0.0, 45.0, 300.0),
        Vec3::new(40.0, -30.0, 300.0),
    ];
    let mut scene = floor_below_an_edge();
    scene.light(triangle, Vec3::splat(20.0));
    let (settings, frames) = many_samples();
    let (pixels, _) = gpu.render(&scene, &settings, frames);
    let (mut worst, mut partial) = (0.0f32, 0);
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        // the plane through the point and the edge x = 0, z = 150; the side that is open
        let normal = Vec3::new(150.0, 0.0, p.x).normalize();
        let seen = clipped(&triangle, normal, p);
        let exact: f32 = (1..seen.len().max(2) - 1)
            .map(|k| lambert(p, Vec3::Z, [seen[0], seen[k], seen[k + 1]], 20.0))
            .sum();
        let whole = lambert(p, Vec3::Z, triangle, 20.0);
        worst = worst.max((pixel.x - exact).abs() / whole);
        partial += usize::from(exact > 0.05 * whole && exact < 0.95 * whole);
    }
    println!("worst {worst} of the whole light, {partial} pixels in the penumbra");
    // 256 rays: four standard errors of a fraction are 0.125
    assert!(worst < 0.125 && partial > 300, "{worst} {partial}");
    // a light sampled only at its centre has no penumbra
    let hard = Settings {
        rt_soft_shadows: false,
        ..all_lights()
    };
    let (pixels, _) = gpu.render(&scene, &hard, 2);
    let mut dark = 0;
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        let whole = lambert(p, Vec3::Z, triangle, 20.0);
        let part = pixel.x / whole;
        assert!(part == 0.0 || (part - 1.0).abs() < 0.05, "{p} {part}");
        // the centre is above x = 0: its shadow ends at the edge's
        assert_eq!(part == 0.0, p.x < 0.0, "{p}");
        dark += usize::from(part == 0.0);
    }
    assert!(dark > 300);
}

fn the_suns_disc_makes_a_penumbra_of_its_own_width(gpu: &mut Gpu) {
    let radius = 0.1f32;
    let mut scene = floor_below_an_edge();
    scene.sun(Vec3::Z, PI, radius);
    let (settings, frames) = many_samples();
    let (pixels, _) = gpu.render(&scene, &settings, frames);
    let mut worst = 0.0f32;
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        // where the edge cuts the disc, in radii from its middle: a chord
        let t = (-p.x / 150.0).atan() / radius;
        let hidden = if t <= -1.0 {
            0.0
        } else if t >= 1.0 {
            1.0
        } else {
            1.0 - (t.acos() - t * (1.0 - t * t).sqrt()) / PI
        };
        worst = worst.max((pixel.x - (1.0 - hidden)).abs());
    }
    println!("worst {worst}");
    assert!(worst < 0.13, "{worst}");
}

fn in_a_furnace_of_sky_a_white_floor_is_as_bright_as_the_sky(gpu: &mut Gpu) {
    let mut scene = floor_from_above(40.0);
    let (low, high) = (
        Vec3::new(-200.0, -150.0, 0.0),
        Vec3::new(220.0, 170.0, 140.0),
    );
    let corner = |i: usize| {
        Vec3::new(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    // four walls and a ceiling, each facing inwards
    for quad in [
        [0, 1, 5, 4],
        [1, 3, 7, 5],
        [3, 2, 6, 7],
        [2, 0, 4, 6],
        [4, 5, 7, 6],
    ] {
        let q = quad.map(corner);
        let middle = (low + high) * 0.5;
        for [a, b, c] in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            let inwards = (b - a).cross(c - a).dot(middle - a) > 0.0;
            scene.light(if inwards { [a, b, c] } else { [a, c, b] }, Vec3::ONE);
        }
    }
    for (settings, tolerance) in [
        (all_lights(), 0.01),
        (
            Settings {
                rt_num_random_dl: 8,
                ..all_lights()
            },
            0.02,
        ),
    ] {
        let (pixels, _) = gpu.render(&scene, &settings, 16);
        let mean = pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32;
        println!("{mean}");
        assert!((mean - 1.0).abs() < tolerance, "{mean}");
    }
}

fn the_flashlight_lights_a_spot_before_the_camera(gpu: &mut Gpu) {
    let scene = floor_from_above(80.0);
    assert_eq!(gpu.mean(&scene, &all_lights(), 1), Vec3::ZERO);
    let settings = Settings {
        rt_flashlight: true,
        ..all_lights()
    };
    let (pixels, _) = gpu.render(&scene, &settings, 8);
    // held beside the camera, at the same height
    let middle = pixels[SIDE / 2 * SIDE + SIDE / 2];
    let expected = (384.0f32 / 90.0).powi(2);
    assert!(
        (middle.x / expected - 1.0).abs() < 0.1,
        "{middle} {expected}"
    );
    assert!(middle.x > middle.y && middle.y > middle.z, "warm: {middle}");
    // the cone ends at 24 degrees: 40 units from its middle
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        if p.truncate().length() > 60.0 {
            assert_eq!(*pixel, Vec3::ZERO, "{p}");
        } else if p.truncate().length() < 25.0 {
            assert!(pixel.x > 0.0, "{p}");
        }
    }
}

fn lights_of_a_brush_model_go_where_it_goes(gpu: &mut Gpu) {
    let triangle = [
        Vec3::new(-5.0, -5.0, 60.0),
        Vec3::new(0.0, 5.0, 60.0),
        Vec3::new(5.0, -5.0, 60.0),
    ];
    for moved in [Vec3::ZERO, Vec3::new(30.0, -20.0, 10.0)] {
        let mut scene = floor_from_above(40.0);
        scene.light(triangle, Vec3::splat(50.0));
        scene.lights[0].model = 1;
        // without its entity, neither the model nor its light exists
        assert_eq!(gpu.mean(&scene, &all_lights(), 1), Vec3::ZERO);
        let instance = scene.instances.len() as u32;
        scene.instances.push(Instance {
            origin: moved,
            ..identity()
        });
        scene
            .submodels
            .push(crate::scene::Submodel { model: 1, instance });
        let from_tree = Settings {
            rt_light_selection: LightSelection::Tree,
            rt_num_random_dl: 1,
            ..all_lights()
        };
        for settings in [all_lights(), from_tree] {
            let (pixels, _) = gpu.render(&scene, &settings, 32);
            let exact: f32 = floor_points(&scene)
                .map(|p| lambert(p, Vec3::Z, triangle.map(|c| c + moved), 50.0))
                .sum();
            let ratio = pixels.iter().map(|p| p.x).sum::<f32>() / exact;
            println!("{:?}: {ratio}", settings.rt_light_selection);
            assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        }
        // a second instance of the model has the same lights, which the tree has once
        let second = Instance {
            origin: moved + Vec3::new(-20.0, 30.0, 0.0),
            ..identity()
        };
        let number = scene.instances.len() as u32;
        scene.instances.push(second);
        scene.submodels.push(crate::scene::Submodel {
            model: 1,
            instance: number,
        });
        let from_tree = Settings {
            rt_light_selection: LightSelection::Tree,
            rt_num_random_dl: 4,
            ..all_lights()
        };
        let [truth, drawn] = [all_lights(), from_tree].map(|s| gpu.mean(&scene, &s, 64).x);
        println!("two instances: {}", drawn / truth);
        assert!((drawn / truth - 1.0).abs() < 0.01, "{truth} {drawn}");
    }
}

/// Many lights of all kinds between pillars.
pub(super) fn crowd() -> Scene {
    let mut scene = Scene::hall(60.0, 0.7, SIDE as i32);
    for i in 0..40 {
        let angle = i as f32 * 2.4;
        let reach = 20.0 + 3.0 * i as f32;
        let at = Vec3::new(angle.cos() * reach, angle.sin() * reach, 100.0);
        let size = 2.0 + (i % 7) as f32 * 6.0;
        scene.lamp(at, size, Vec3::splat(0.5 + (i % 5) as f32));
    }
    for i in 0..70 {
        let angle = i as f32 * 2.4;
        scene.dlight(
            Vec3::new(
                angle.cos() * 130.0,
                angle.sin() * 120.0,
                (i % 9) as f32 * 10.0 - 40.0,
            ),
            20.0 + (i % 4) as f32 * 20.0,
            1.0,
        );
    }
    for i in 0..3 {
        scene.sun(Vec3::new(i as f32 - 1.0, 0.3, 1.5).normalize(), 0.2, 0.01);
    }
    scene
}

/// The same in a map whose one cluster is cut into cells; rays have measured, not exactly, how much of each light
/// arrives.
fn crowd_in_cells() -> Scene {
    let mut scene = crowd();
    let mut map = q3bsp::builder::MapBuilder::new();
    map.add_cell(Vec3::splat(-400.0), Vec3::splat(400.0));
    let lights: Vec<u32> = (0..40).collect();
    let share = |light: &u32| relight::light::LightShare {
        bare: 1.0,
        visible: 0.25 + 0.25 * (light % 4) as f32,
    };
    let lists = relight::light::LightLists {
        // the cluster, and places outside of it
        offsets: vec![0, 40, 80],
        shares: lights.iter().map(share).collect(),
        lights: lights.iter().chain(&lights).copied().collect(),
        triangle_lights: 40,
        sky: vec![true],
    };
    scene.tree = Some((map.build(), lists));
    scene
}

/// If pixels are independent and unbiased, their differences have mean zero: then the sum of differences over the root
/// of the sum of their squares is normally distributed with a deviation of one, in the picture and in each square of
/// it. Four and a half deviations happen in one picture of some hundred thousand.
fn differs_by_noise_alone(pixels: &[Vec3], truth: &[Vec3], what: &str) {
    const BOUND: f32 = 4.5;
    let score = |chosen: &dyn Fn(usize) -> bool| {
        let differences = pixels.iter().zip(truth).enumerate();
        let (sum, squares) = differences
            .filter(|(i, _)| chosen(*i))
            .map(|(_, (a, b))| a.x - b.x)
            .fold((0.0f32, 0.0f32), |(s, q), d| (s + d, q + d * d));
        sum / squares.sqrt().max(f32::MIN_POSITIVE)
    };
    let whole = score(&|_| true);
    println!("{what}: {whole} standard errors");
    assert!(whole.abs() < BOUND, "{what}: {whole}");
    for tile in 0..16 {
        let part = score(&|i| i % SIDE / 8 == tile % 4 && i / SIDE / 8 == tile / 4);
        assert!(part.abs() < BOUND, "{what}: tile {tile} {part}");
    }
}

fn estimators_differ_by_noise_alone(gpu: &mut Gpu) {
    let scene = crowd();
    let (truth, _) = gpu.render(&scene, &all_lights(), 16);
    let in_cells = crowd_in_cells();
    for selection in [
        LightSelection::Uniform,
        LightSelection::Resampled,
        LightSelection::Tree,
    ] {
        // one sample per pixel has a pass of its own
        for (candidates, samples, frames) in [(3, 16, 12), (8, 16, 12), (8, 1, 192)] {
            let settings = Settings {
                rt_light_selection: selection,
                rt_num_random_dl: samples,
                rt_candidates: candidates,
                ..all_lights()
            };
            for (scene, lists) in [(&scene, "one list"), (&in_cells, "cells")] {
                let (pixels, _) = gpu.render(scene, &settings, frames);
                let what = format!("{selection:?}, {candidates} candidates, {lists}");
                differs_by_noise_alone(&pixels, &truth, &what);
            }
        }
    }
    let (pixels, _) = gpu.render(&in_cells, &all_lights(), 48);
    differs_by_noise_alone(&pixels, &truth, "all lights of cells");
}

/// Triangles of all directions and point lights throughout a hall, so that surfaces lie within the nodes of a tree over
/// them; some belong to brush models.
pub(super) fn cloud() -> Scene {
    let mut scene = Scene::hall(60.0, 0.7, SIDE as i32);
    let part = |n: u32| (f64::from(n) * 0.618_033_988_749_895).fract() as f32 - 0.5;
    for i in 0..120u32 {
        let at = Vec3::new(
            part(i) * 380.0,
            part(i * 7 + 1) * 280.0,
            part(i * 13 + 2) * 180.0 + 20.0,
        );
        let normal = Vec3::new(part(i * 3), part(i * 5), part(i * 11));
        let (x, y) = normal.normalize().any_orthonormal_pair();
        let size = 2.0 + (i % 7) as f32 * 3.0;
        let strength = Vec3::splat(0.5 + (i % 5) as f32);
        scene.light([at, at + x * size, at + y * size], strength);
        if let Some(light) = scene.lights.last_mut() {
            light.two_sided = i % 11 == 0;
            light.model = if i % 6 == 0 { 1 + i % 2 } else { 0 };
        }
    }
    for i in 0..8 {
        scene.point(
            Vec3::new(i as f32 * 40.0 - 150.0, 60.0, 40.0),
            400.0 + 50.0 * i as f32,
            4.0,
        );
    }
    let first = scene.instances.len() as u32;
    for model in [1, 2] {
        scene.instances.push(Instance {
            origin: Vec3::new(8.0, -5.0, 3.0) * model as f32,
            ..identity()
        });
        scene.submodels.push(crate::scene::Submodel {
            model,
            instance: first + model - 1,
        });
    }
    scene
}

fn a_tree_finds_each_light_from_within_its_nodes(gpu: &mut Gpu) {
    let scene = cloud();
    let (truth, _) = gpu.render(&scene, &all_lights(), 16);
    let mean = |pixels: &[Vec3]| pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32;
    assert!(mean(&truth) > 0.01, "a test of nothing");
    // one candidate: a descent alone
    for (candidates, samples, frames) in [(1, 16, 24), (8, 16, 12), (8, 1, 192)] {
        let settings = Settings {
            rt_light_selection: LightSelection::Tree,
            rt_num_random_dl: samples,
            rt_candidates: candidates,
            ..all_lights()
        };
        let (pixels, _) = gpu.render(&scene, &settings, frames);
        let what = format!("{candidates} candidates, {samples} samples");
        println!("{what}: {} of all lights", mean(&pixels) / mean(&truth));
        differs_by_noise_alone(&pixels, &truth, &what);
        let off = mean(&pixels) / mean(&truth) - 1.0;
        assert!(off.abs() < 0.005, "{what}: {off}");
    }
}

fn a_chosen_ray_goes_where_it_was_sent(gpu: &mut Gpu) {
    // a small, distant lamp in a slightly wider hole: a direction error of 1e-5 makes a ray miss the hole
    const HEIGHT: f32 = 4000.0;
    const LAMP: f32 = 0.125;
    const HOLE: f32 = 0.131;
    const BEFORE: f32 = 2.0;
    let mut scene = floor_from_above(10.0);
    let corner = |x: f32, y: f32| Vec3::new(x * LAMP, y * LAMP, HEIGHT);
    for side in [1.0, -1.0] {
        let triangle = [
            corner(-side, -side),
            corner(-side, side),
            corner(side, -side),
        ];
        scene.light(triangle, Vec3::splat(4.0e8));
    }
    let wall = scene.material(&[stage::light()], c::MATERIAL_TWO_SIDED);
    let (x, y) = (Vec3::X, Vec3::Y);
    for (beside, along) in [(x, y), (y, x), (-x, y), (-y, x)] {
        let first = Vec3::Z * (HEIGHT - BEFORE) + beside * HOLE - along * 50.0;
        scene.quad(rectangle(first, along * 100.0, beside * 50.0), wall);
    }
    let (truth, _) = gpu.render(&scene, &all_lights(), 16);
    let chosen = Settings {
        rt_light_selection: LightSelection::Resampled,
        rt_num_random_dl: 1,
        ..all_lights()
    };
    let (pixels, _) = gpu.render(&scene, &chosen, 64);
    let sum = |pixels: &[Vec3]| pixels.iter().map(|p| p.x).sum::<f32>();
    let mean = sum(&truth) / truth.len() as f32;
    println!("light {mean}, chosen {}", sum(&pixels) / sum(&truth));
    assert!((0.3..1.0).contains(&mean), "{mean}");
    let off = sum(&pixels) / sum(&truth) - 1.0;
    assert!(off.abs() < 0.01, "{off}");
}

fn errors_fall_faster_than_those_of_independent_frames(gpu: &mut Gpu) {
    let scene = crowd();
    let (truth, _) = gpu.render(&scene, &all_lights(), 48);
    for (selection, bound) in [
        (LightSelection::Uniform, 0.25),
        (LightSelection::Resampled, 0.3),
        (LightSelection::Tree, 0.3),
    ] {
        let settings = Settings {
            rt_light_selection: selection,
            rt_num_random_dl: 1,
            ..all_lights()
        };
        // mean square error times the number of frames: constant if frames are independent
        let mut noise = |frames: u32| {
            let (pixels, _) = gpu.render(&scene, &settings, frames);
            let errors = pixels.iter().zip(&truth).map(|(a, b)| (a.x - b.x).powi(2));
            errors.sum::<f32>() / pixels.len() as f32 * frames as f32
        };
        let (first, later) = (noise(4), noise(512));
        println!("{selection:?}: {first} after 4 frames, {later} after 512");
        assert!(later < bound * first, "{selection:?}: {first} {later}");
    }
}
