//! Direct and bounced light.

use glam::Vec3;
use relight::light::Pulse;
use relight::world::StyleStrength;

use super::bounces::{floor_before_a_wall, furnace, lambert_of_quad, seen};
use super::harness::{
    Gpu, Scene, bounced, ceiling_at, encode, floor_at, floor_points, gpu_tests, lambert, reference,
    through_byte,
};
use crate::settings::{DebugOutput, LightSelection, Settings};

gpu_tests! {
    any: [
        one_triangle_gives_the_irradiance_of_the_closed_form,
        all_estimators_have_the_same_mean,
        triangles_end_alone_and_quads_together,
        spheres_and_suns_give_their_irradiance,
        a_white_room_bounces_what_its_walls_give,
        bounced_light_of_listed_lights_is_counted_once,
        a_point_is_lit_by_the_list_of_its_cluster,
        points_pulse_with_their_style,
        blue_noise_keeps_the_mean_and_lacks_low_frequencies,
    ],
    each: [
        an_umbra_is_black_and_a_penumbra_is_between,
        facets_of_a_ball_do_not_shadow_it,
    ],
}

/// Methods of light sampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LightSampling {
    Uniform,
    Resampled,
    All,
    Tree,
}

/// Those that sample lists of lights.
const OF_LISTS: [LightSampling; 3] = [
    LightSampling::Uniform,
    LightSampling::Resampled,
    LightSampling::All,
];

const ALL: [LightSampling; 4] = [
    LightSampling::Uniform,
    LightSampling::Resampled,
    LightSampling::All,
    LightSampling::Tree,
];

/// A white floor and a slanted camera.
fn floor() -> Scene {
    let mut scene = Scene::new(Vec3::new(-100.0, 0.0, 80.0), Vec3::ZERO, 20.0, 32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 500.0), white);
    scene
}

fn sampled(sampling: LightSampling) -> Settings {
    Settings {
        rt_num_random_dl: if sampling == LightSampling::All { 0 } else { 4 },
        rt_light_selection: match sampling {
            LightSampling::Uniform => LightSelection::Uniform,
            LightSampling::Tree => LightSelection::Tree,
            LightSampling::Resampled | LightSampling::All => LightSelection::Resampled,
        },
        ..reference()
    }
}

/// Mean of |a - b| / b over the picture.
fn mean_difference(a: &[Vec3], b: impl Iterator<Item = f32>) -> f32 {
    let pairs = a.iter().zip(b);
    let sum: f32 = pairs.map(|(a, b)| (a.x - b).abs() / b.max(1.0e-6)).sum();
    sum / a.len() as f32
}

fn one_triangle_gives_the_irradiance_of_the_closed_form(gpu: &mut Gpu) {
    // near: sampled by solid angle; far and small: sampled by area
    for triangle in [
        [
            Vec3::new(-40.0, -30.0, 60.0),
            Vec3::new(0.0, 50.0, 60.0),
            Vec3::new(50.0, -40.0, 70.0),
        ],
        [
            Vec3::new(300.0, 0.0, 400.0),
            Vec3::new(303.0, 5.0, 400.0),
            Vec3::new(306.0, 0.0, 402.0),
        ],
    ] {
        let mut scene = floor();
        scene.light(triangle, Vec3::splat(5.0));
        let exact: Vec<f32> = floor_points(&scene)
            .map(|p| lambert(p, Vec3::Z, triangle, 5.0))
            .collect();
        for sampling in [LightSampling::Resampled, LightSampling::Tree] {
            let (pixels, _) = gpu.render(&scene, &sampled(sampling), 64);
            let difference = mean_difference(&pixels, exact.iter().copied());
            let ratio = pixels.iter().map(|p| p.x).sum::<f32>() / exact.iter().sum::<f32>();
            println!("{sampling:?}: mean relative difference {difference}, ratio {ratio}");
            assert!(difference < 0.002, "{difference}");
            assert!((ratio - 1.0).abs() < 0.0005, "{ratio}");
        }
        // no light behind a one-sided light
        let mut scene = floor();
        scene.light([triangle[0], triangle[2], triangle[1]], Vec3::splat(5.0));
        assert_eq!(
            gpu.mean(&scene, &sampled(LightSampling::Resampled), 2),
            Vec3::ZERO
        );
    }
}

fn all_estimators_have_the_same_mean(gpu: &mut Gpu) {
    let mut scene = Scene::hall(60.0, 0.7, 32);
    for i in 0..12 {
        let angle = i as f32 * 0.53;
        let at = Vec3::new(
            angle.cos() * 150.0,
            angle.sin() * 120.0,
            80.0 + (i % 3) as f32 * 10.0,
        );
        // downwards
        scene.lamp(at, 20.0, Vec3::splat(4.0 + i as f32));
    }
    scene.point(Vec3::new(0.0, 90.0, 20.0), 2000.0, 4.0);
    scene.dlight(Vec3::new(-60.0, -80.0, 0.0), 200.0, 1.0);
    let frames = |sampling| {
        if sampling == LightSampling::All {
            32
        } else {
            128
        }
    };
    let means: Vec<Vec<Vec3>> = ALL
        .iter()
        .map(|&s| gpu.render(&scene, &sampled(s), frames(s)).0)
        .collect();
    let total = |m: &[Vec3]| m.iter().map(|p| p.x).sum::<f32>() / m.len() as f32;
    let truth = total(&means[2]);
    for (mean, sampling) in means.iter().zip(ALL) {
        let ratio = total(mean) / truth;
        let difference = mean_difference(mean, means[2].iter().map(|p| p.x.max(0.05 * truth)));
        println!("{sampling:?}: mean {ratio} of All, pixels differ by {difference}");
        assert!((ratio - 1.0).abs() < 0.005, "{sampling:?} {ratio}");
        // noise of the sampled ones, not bias
        assert!(difference < 0.08, "{sampling:?} {difference}");
    }
    // resampling has smaller errors than uniform selection at an equal, small number of rays
    let mut error = |sampling| {
        let (few, _) = gpu.render(&scene, &sampled(sampling), 2);
        let errors = few.iter().zip(&means[2]).map(|(a, b)| (a.x - b.x).powi(2));
        errors.sum::<f32>()
    };
    let (uniform, resampled) = (
        error(LightSampling::Uniform),
        error(LightSampling::Resampled),
    );
    println!("errors of two frames: {uniform}, resampled {resampled}");
    assert!(resampled < 0.5 * uniform, "{resampled} {uniform}");
}

fn an_umbra_is_black_and_a_penumbra_is_between(gpu: &mut Gpu) {
    let triangle = [
        Vec3::new(-5.0, -5.0, 200.0),
        Vec3::new(0.0, 5.0, 200.0),
        Vec3::new(5.0, -5.0, 200.0),
    ];
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 90.0), Vec3::ZERO, 80.0, 32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 500.0), white);
    // between light and floor, above the camera
    scene.quad(ceiling_at(100.0, 20.0), white);
    scene.light(triangle, Vec3::splat(1000.0));
    let (pixels, _) = gpu.render(&scene, &sampled(LightSampling::All), 16);
    let mut umbra = 0;
    let mut partial = 0;
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        let extent = p.x.abs().max(p.y.abs());
        // the plate's shadow extends to 40 on the floor; the light's size blurs it by 5, a pixel covers 5
        if extent < 30.0 {
            umbra += 1;
            assert_eq!(*pixel, Vec3::ZERO, "{p}");
        } else if extent > 52.0 {
            let exact = lambert(p, Vec3::Z, triangle, 1000.0);
            assert!(
                (pixel.x / exact - 1.0).abs() < 0.05,
                "{p} {} {exact}",
                pixel.x
            );
        } else if pixel.x > 0.0 && pixel.x < 0.8 * lambert(p, Vec3::Z, triangle, 1000.0) {
            partial += 1;
        }
    }
    assert!(umbra > 50 && partial > 20, "{umbra} {partial}");
}

fn triangles_end_alone_and_quads_together(gpu: &mut Gpu) {
    let mut scene = floor();
    let at = |x, y| Vec3::new(x, y, 90.0);
    let (low, high) = (at(-4.0, -4.0), at(4.0, 4.0));
    scene.light([low, at(-4.0, 4.0), high], Vec3::splat(400.0));
    scene.light([low, high, at(4.0, -4.0)], Vec3::splat(400.0));
    let brightest = |gpu: &mut Gpu, scene: &Scene| {
        let (pixels, _) = gpu.render(scene, &sampled(LightSampling::All), 8);
        pixels.iter().map(|p| p.x).fold(0.0, f32::max)
    };
    let whole = brightest(gpu, &scene);
    assert!(whole > 0.1, "a test of nothing: {whole}");
    // above the contribution of each light alone, below their sum
    scene.light_cutoff = 0.75 * whole;
    let together = brightest(gpu, &scene);
    assert!((together / whole - 1.0).abs() < 0.02, "{together} {whole}");
    for (light, triangle) in scene.lights.iter_mut().zip(0..) {
        light.triangle = triangle;
    }
    assert_eq!(brightest(gpu, &scene), 0.0);
    scene.light_cutoff = 0.25 * whole;
    let alone = brightest(gpu, &scene);
    assert!((alone / whole - 1.0).abs() < 0.02, "{alone} {whole}");
}

fn spheres_and_suns_give_their_irradiance(gpu: &mut Gpu) {
    let check = |gpu: &mut Gpu, scene: &Scene, exact: &dyn Fn(Vec3) -> f32| {
        let (pixels, _) = gpu.render(scene, &sampled(LightSampling::Resampled), 32);
        let difference = mean_difference(&pixels, floor_points(scene).map(exact));
        println!("{difference}");
        assert!(difference < 0.01, "{difference}");
    };
    let at = Vec3::new(20.0, 10.0, 90.0);
    // a small sphere is a point light: E = I cos / d²
    let falloff = |p: Vec3| (at.z / (at - p).length()) / (at - p).length_squared();
    let mut scene = floor();
    scene.point(at, 7000.0, 4.0);
    let full = |p: Vec3| 7000.0 * falloff(p) / std::f32::consts::PI;
    check(gpu, &scene, &full);
    // where it gives too little it gives nothing; at the edge its size and the pixels' blur that
    let end = full(Vec3::new(at.x + 20.0, at.y, 0.0));
    scene.light_cutoff = end;
    let (pixels, _) = gpu.render(&scene, &sampled(LightSampling::Resampled), 32);
    let (mut dark, mut lit) = (0, 0);
    for (i, (pixel, exact)) in pixels
        .iter()
        .zip(floor_points(&scene).map(full))
        .enumerate()
    {
        if exact < end * 0.95 {
            dark += 1;
            assert_eq!(pixel.x, 0.0, "{i}");
        } else if exact > end * 1.05 {
            lit += 1;
            assert!(
                (pixel.x / exact - 1.0).abs() < 0.05,
                "{i} {} {exact}",
                pixel.x
            );
        }
    }
    assert!(dark > 20 && lit > 5, "{dark} {lit}");
    scene.light_cutoff = 0.0;
    // a linear light: E = 8 I / R² (cos - d / R)
    let linear = relight::light::Falloff::Linear { reach: 160.0 };
    scene.points[0].falloff = linear;
    check(gpu, &scene, &|p| {
        let distance = (at - p).length();
        7000.0 * linear.irradiance(distance, at.z / distance) / std::f32::consts::PI
    });
    // a facing white surface at half the reach has the colour of the dynamic light
    let mut scene = floor();
    scene.dlight(at, 200.0, 1.0);
    check(gpu, &scene, &|p| 100.0 * 100.0 * falloff(p));
    // closer than 0.35 of its reach it is no stronger
    let near = Vec3::new(20.0, 10.0, 24.0);
    let mut scene = floor();
    scene.dlight(near, 240.0, 0.5);
    check(gpu, &scene, &|p| {
        let distance = (near - p).length();
        let colour = crate::trace::frame_lights::decode(Vec3::splat(0.5)).x;
        colour * near.z / distance * (120.0 / distance.max(84.0)).powi(2)
    });
    // along a line: a capsule
    let ends = [Vec3::new(-70.0, 10.0, 60.0), Vec3::new(90.0, -30.0, 100.0)];
    let mut scene = floor();
    scene.dlight(ends[0], 120.0, 1.0);
    scene.dlights[0].end = Some(ends[1]);
    let strength = 60.0 * 60.0 * (1.0 + (ends[0].distance(ends[1]) / 120.0).powi(2)).sqrt();
    check(gpu, &scene, &|p| {
        let parts = (0..400).map(|i| (i as f32 + 0.5) / 400.0);
        let light = parts.map(|part| {
            let to = ends[0].lerp(ends[1], part) - p;
            to.z / to.length() / to.length_squared().max(42.0 * 42.0)
        });
        strength * light.sum::<f32>() / 400.0
    });
    let mut scene = floor();
    let direction = Vec3::new(0.3, 0.2, 0.8).normalize();
    scene.sun(direction, 2.0, 0.005);
    check(gpu, &scene, &|_| 2.0 * direction.z / std::f32::consts::PI);
    // a low sun: few rays, each of greater weight
    let low = Vec3::new(0.8, 0.6, 0.008).normalize();
    scene.suns.clear();
    scene.sun(low, 200.0, 0.001);
    let (pixels, _) = gpu.render(&scene, &sampled(LightSampling::Resampled), 32);
    let mean = pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32;
    let exact = 200.0 * low.z / std::f32::consts::PI;
    assert!((mean / exact - 1.0).abs() < 0.01, "{mean} {exact}");
    // the ambient light has no shadows
    let mut scene = floor();
    scene.ambient = Vec3::splat(0.25);
    check(gpu, &scene, &|_| 0.25);
}

fn a_white_room_bounces_what_its_walls_give(gpu: &mut Gpu) {
    // every wall glows with radiance e and reflects rho: one bounce adds rho * e, two add rho² * e more
    let scene = furnace(0.5, 1.0);
    let [glow, albedo] = [0.25, 0.5].map(|v| through_byte(encode(v)));
    for (bounces, exact) in [
        (0, seen(glow, albedo, 0.0)),
        (1, seen(glow, albedo, glow)),
        (2, seen(glow, albedo, glow * (1.0 + albedo))),
    ] {
        let frames = if bounces > 1 { 32 } else { 4 };
        let mean = gpu.mean(&scene, &bounced(bounces), frames).x;
        println!("{bounces}: {mean} {exact}");
        assert!(
            (mean / exact - 1.0).abs() < 0.002,
            "{bounces}: {mean} {exact}"
        );
    }
}

fn bounced_light_of_listed_lights_is_counted_once(gpu: &mut Gpu) {
    // a floor lit by a wall that the sun lights: by form factor of the wall, seen from the floor's point
    let (mut scene, wall) = floor_before_a_wall([encode(0.5); 3]);
    // the sun stands low behind the camera: it lights the wall in full and the floor too
    let direction = Vec3::new(-1.0, 0.0, 0.2).normalize();
    scene.sun(direction, 3.0, 0.002);
    let (pixels, _) = gpu.render(&scene, &bounced(1), 256);
    let direct = 3.0 * direction.z / std::f32::consts::PI;
    let albedo = through_byte(encode(0.5));
    let wall_radiance = albedo * 3.0 * -direction.x / std::f32::consts::PI;
    let truth: f32 = floor_points(&scene)
        .map(|p| direct + lambert_of_quad(p, wall, wall_radiance))
        .sum();
    let ratio = pixels.iter().map(|p| p.x).sum::<f32>() / truth;
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

fn a_point_is_lit_by_the_list_of_its_cluster(gpu: &mut Gpu) {
    // two adjacent cells without a wall between them: only the lists differ
    let mut map = q3bsp::builder::MapBuilder::new();
    let far = map.add_cell(
        Vec3::new(-400.0, -400.0, -64.0),
        Vec3::new(0.0, 400.0, 320.0),
    );
    let near = map.add_cell(
        Vec3::new(0.0, -400.0, -64.0),
        Vec3::new(400.0, 400.0, 320.0),
    );
    let bsp = map.build();
    let [left, right] = [far, near].map(|c| usize::try_from(c).expect("a cluster"));
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 90.0), Vec3::ZERO, 60.0, 32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 300.0), white);
    let red = [
        Vec3::new(-20.0, 0.0, 200.0),
        Vec3::new(-20.0, 9.0, 200.0),
        Vec3::new(-10.0, 0.0, 200.0),
    ];
    let green = red.map(|p| p + Vec3::X * 30.0);
    scene.light(red, Vec3::new(90.0, 0.0, 0.0));
    scene.light(green, Vec3::new(0.0, 90.0, 0.0));
    // the left cell lists the first light, the right one the second, outside both
    let mut rows = [vec![], vec![]];
    rows[left].push(0);
    rows[right].push(1);
    let lights: Vec<u32> = rows.concat().into_iter().chain([0, 1]).collect();
    let lists = relight::light::LightLists {
        offsets: vec![0, 1, 2, 4],
        lights,
        triangle_lights: 2,
        sky: Vec::new(),
        shares: Vec::new(),
    };
    scene.tree = Some((bsp, lists));
    for sampling in OF_LISTS {
        let (pixels, _) = gpu.render(&scene, &sampled(sampling), 4);
        for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
            // a pixel is four units wide
            if p.x < -4.0 {
                assert!(pixel.x > 0.0 && pixel.y == 0.0, "{sampling:?} {p} {pixel}");
            } else if p.x > 4.0 {
                assert!(pixel.x == 0.0 && pixel.y > 0.0, "{sampling:?} {p} {pixel}");
            }
        }
    }
}

fn points_pulse_with_their_style(gpu: &mut Gpu) {
    let wave = shaderscript::Wave {
        function: shaderscript::WaveFunction::Square,
        base: 0.5,
        amplitude: 0.5,
        phase: 0.0,
        frequency: 1.0,
    };
    let (mean, pulse) = Pulse::of(StyleStrength::Wave(wave));
    let at = [Vec3::new(20.0, 10.0, 90.0), Vec3::new(-30.0, 0.0, 80.0)];
    let mut scene = floor();
    scene.point(at[0], 7000.0 * mean, 4.0);
    scene.points[0].pulse = pulse;
    scene.point(at[1], 3000.0, 4.0);
    for (time, strength) in [(250, 1.0), (750, 0.0)] {
        scene.def.time_ms = time;
        let given = |p: Vec3, at: Vec3| {
            let offset = at - p;
            at.z / offset.length().powi(3) / std::f32::consts::PI
        };
        let exact = |p| strength * 7000.0 * given(p, at[0]) + 3000.0 * given(p, at[1]);
        for (sampling, bound) in [(LightSampling::All, 0.01), (LightSampling::Tree, 0.02)] {
            let (pixels, _) = gpu.render(&scene, &sampled(sampling), 64);
            let difference = mean_difference(&pixels, floor_points(&scene).map(exact));
            println!("{sampling:?}, {time} ms: {difference}");
            assert!(difference < bound, "{sampling:?}, {time}: {difference}");
        }
    }
}

fn facets_of_a_ball_do_not_shadow_it(gpu: &mut Gpu) {
    // a convex body shows E cos / pi wherever its normal faces the sun, however coarse its triangles are
    let sun = Vec3::new(0.39, 0.92, 0.1).normalize();
    let dark_pixels = |gpu: &mut Gpu, curved: bool| {
        let mut scene = Scene::new(Vec3::new(-100.0, 0.0, 10.0), Vec3::ZERO, 24.0, 64);
        let white = scene.diffuse(1.0);
        scene.ball(Vec3::ZERO, 20.0, 4, white, curved);
        scene.sun(sun, 2.0, 1.0e-5);
        let settings = Settings {
            rt_antialiasing: false,
            ..reference()
        };
        let (pixels, _) = gpu.render(&scene, &settings, 2);
        let normals = Settings {
            rt_debug: DebugOutput::Normals,
            ..settings
        };
        let (_, normals) = gpu.render(&scene, &normals, 2);
        let (mut dark, mut lit) = (0, 0);
        for (pixel, [x, y, z, _]) in pixels.iter().zip(normals) {
            let cosine = (Vec3::from([x, y, z].map(f32::from)) / 127.5 - 1.0).dot(sun);
            // black outside of the ball; eight bits of the normal are too coarse for grazing light
            if [x, y, z] == [0; 3] || cosine < 0.2 {
                continue;
            }
            let part = pixel.x / (2.0 * cosine / std::f32::consts::PI);
            match part {
                0.96..1.04 => lit += 1,
                0.0..0.01 => dark += 1,
                _ => panic!("{part} of the light at a cosine of {cosine}"),
            }
        }
        println!("curved: {curved}; {lit} pixels are lit, {dark} in the shadow of facets");
        assert!(lit > 300, "{lit}");
        dark
    };
    assert!(dark_pixels(gpu, false) > 20, "the facets show without it");
    assert_eq!(dark_pixels(gpu, true), 0);
}

/// Variance of the pixels' relative errors, and of their means over blocks of 4 x 4 pixels.
fn error_variances(picture: &[Vec3], mean: &[Vec3], size: usize) -> [f32; 2] {
    let error = |i: usize| picture[i].x / mean[i].x - 1.0;
    let variance = |errors: &[f32]| errors.iter().map(|e| e * e).sum::<f32>() / errors.len() as f32;
    let pixels: Vec<f32> = (0..size * size).map(error).collect();
    let block = |block: usize| {
        let corner = block / (size / 4) * 4 * size + block % (size / 4) * 4;
        (0..16)
            .map(|i| pixels[corner + i / 4 * size + i % 4])
            .sum::<f32>()
            / 16.0
    };
    let blocks: Vec<f32> = (0..size * size / 16).map(block).collect();
    [variance(&pixels), variance(&blocks)]
}

fn blue_noise_keeps_the_mean_and_lacks_low_frequencies(gpu: &mut Gpu) {
    const SIZE: usize = 64;
    let mut scene = Scene::new(Vec3::new(-100.0, 0.0, 80.0), Vec3::ZERO, 20.0, SIZE as i32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 500.0), white);
    // a penumbra over the whole picture
    scene.quad(ceiling_at(120.0, 30.0), white);
    scene.lamp(Vec3::new(-100.0, -100.0, 240.0), 200.0, Vec3::ONE);
    let mut drawn = |rt_blue_noise, frames| {
        let settings = Settings {
            rt_blue_noise,
            ..reference()
        };
        gpu.render(&scene, &settings, frames).0
    };
    let [mean, blue_mean] = [false, true].map(|blue| drawn(blue, 256));
    let total = |picture: &[Vec3]| picture.iter().map(|p| p.x).sum::<f32>();
    let ratio = total(&blue_mean) / total(&mean);
    assert!((ratio - 1.0).abs() < 0.003, "{ratio}");
    let of = |blue| error_variances(&drawn(blue, 1), &mean, SIZE);
    let [[pixels, blocks], [blue_pixels, blue_blocks]] = [false, true].map(of);
    // the same noise in a pixel, less of it in blocks: both coordinates are blue noise, their pairs are not
    assert!(
        (0.7..1.4).contains(&(blue_pixels / pixels)),
        "{blue_pixels} and {pixels}"
    );
    assert!(blue_blocks < 0.75 * blocks, "{blue_blocks} and {blocks}");
}
