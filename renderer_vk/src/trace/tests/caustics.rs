//! Light that photons bring through glass and water, compared with closed forms.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use shaders::trace_types::constants::COUNT_PHOTONS;
use shaders::types::constants as c;

use super::dielectrics::{LIQUID, clear_body, fresnel};
use super::harness::{
    Gpu, Scene, bounced, ceiling_at, floor_at, floor_points, gpu_tests, reference,
};
use crate::settings::Settings;
use crate::trace::view_tracer::ViewTracer;

gpu_tests! {
    any: [
        light_below_water_follows_fresnel,
        water_reflects_all_light_of_lamps_below_it_beyond_its_angle,
        light_below_a_block_of_glass_has_passed_both_faces,
        a_ball_focuses_the_sun_as_rays_through_a_sphere_do,
        glass_and_water_of_index_1_change_nothing,
        frames_without_photons_have_the_same_bits,
    ],
}

const GLASS: u32 = c::MATERIAL_GLASS | c::MATERIAL_TRANSLUCENT;
const SIDE: i32 = 16;

fn with_caustics(settings: Settings) -> Settings {
    Settings {
        rt_caustics: true,
        ..settings
    }
}

/// A white floor seen from a height, straight down.
fn floor(height: f32, fov: f32) -> Scene {
    let mut scene = Scene::new(Vec3::Z * height, Vec3::ZERO, fov, SIDE);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 400.0), white);
    scene
}

/// The direction to a sun at this angle from the zenith.
fn towards_sun(angle: f32) -> Vec3 {
    Vec3::new(angle.sin(), 0.0, angle.cos())
}

fn mean(pixels: &[Vec3]) -> f32 {
    pixels.iter().map(|p| p.x).sum::<f32>() / pixels.len() as f32
}

fn light_below_water_follows_fresnel(gpu: &mut Gpu) {
    gpu.look.photons.count = 1 << 15;
    for angle in [0.3f32, 1.1] {
        let mut scene = floor(30.0, 60.0);
        let water = clear_body(&mut scene, LIQUID, 1.33);
        scene.quad(floor_at(40.0, 100.0), water);
        scene.sun(towards_sun(angle), PI, 0.001);
        let (pixels, _) = gpu.render(&scene, &with_caustics(reference()), 48);
        let exact = angle.cos() * (1.0 - fresnel(angle, 1.33).unwrap());
        let ratio = mean(&pixels) / exact;
        println!("{angle}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.01, "{angle}: {ratio}");
        // and the straight light without them
        let (pixels, _) = gpu.render(&scene, &reference(), 1);
        assert!((mean(&pixels) / angle.cos() - 1.0).abs() < 0.01);
    }
}

fn water_reflects_all_light_of_lamps_below_it_beyond_its_angle(gpu: &mut Gpu) {
    gpu.look.photons.count = 1 << 15;
    // a small lamp that faces up, on the left of the view
    let (at, size, high, radiance) = (Vec3::new(-110.0, 0.0, 10.0), 4.0, 40.0, 100.0);
    let mut scene = floor(30.0, 60.0);
    let water = clear_body(&mut scene, LIQUID, 1.33);
    scene.quad(floor_at(high, 120.0), water);
    let corners = [at, at + Vec3::X * size, at + Vec3::Y * size];
    scene.light(corners, Vec3::splat(radiance));
    // with light across the flat mirror of the water's surface, which must leave this light to photons
    let (pixels, _) = gpu.render(&scene, &with_caustics(bounced(1)), 64);
    let image = corners.iter().sum::<Vec3>() / 3.0 + Vec3::Z * (2.0 * (high - at.z));
    let exact: f32 = floor_points(&scene)
        .map(|p| {
            let away = image - p;
            let cosine = away.z / away.length();
            let mirrored = fresnel(cosine.acos(), 1.0 / 1.33);
            let area = 0.5 * size * size;
            assert!(mirrored.is_none(), "all light is reflected");
            radiance * area * cosine * cosine / (away.length_squared() * PI)
        })
        .sum();
    let ratio = mean(&pixels) * (SIDE * SIDE) as f32 / exact;
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
}

fn light_below_a_block_of_glass_has_passed_both_faces(gpu: &mut Gpu) {
    gpu.look.photons.count = 1 << 16;
    let angle = 0.8f32;
    let mut scene = floor(20.0, 60.0);
    let glass = clear_body(&mut scene, GLASS, 1.5);
    let (low, high) = (Vec3::new(-80.0, -80.0, 30.0), Vec3::new(80.0, 80.0, 60.0));
    scene.block(low, high, glass);
    scene.sun(towards_sun(angle), PI, 0.001);
    let (pixels, _) = gpu.render(&scene, &with_caustics(reference()), 32);
    // with the light that the faces reflect to and fro
    let face = fresnel(angle, 1.5).unwrap();
    let exact = angle.cos() * (1.0 - face) / (1.0 + face);
    let ratio = mean(&pixels) / exact;
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
}

/// Where light straight down the axis at the distance `off` from it leaves a sphere of radius 1 around the origin, and what
/// is left of it: after each reflection inside.
fn through_sphere(off: f32, index: f32) -> Vec<(Vec3, Vec3, f32)> {
    let mut at = Vec3::new(off, 0.0, (1.0 - off * off).sqrt());
    let enters = at.z.min(1.0).acos();
    let inner = (-Vec3::Z).refract(at, 1.0 / index);
    let (mut direction, mut left) = (inner, 1.0 - fresnel(enters, index).unwrap());
    let mut exits = Vec::new();
    for _ in 0..6 {
        at += direction * (-2.0 * direction.dot(at));
        let mirrored = fresnel(direction.dot(at).min(1.0).acos(), 1.0 / index).unwrap_or(1.0);
        exits.push((at, direction.refract(-at, index), left * (1.0 - mirrored)));
        left *= mirrored;
        direction = direction.reflect(-at);
    }
    exits
}

/// Light in a circle of the radius `within` on a plane, of parallel light of irradiance pi that a sphere of glass focuses
/// from the height `above`: L times the area.
fn focused(radius: f32, above: f32, within: f32) -> f32 {
    let rings = 20_000;
    let ring = |i: i32| {
        let off = (i as f32 + 0.5) / rings as f32;
        let area = TAU * off / rings as f32 * radius * radius;
        let exits = through_sphere(off, 1.5).into_iter();
        let lands = |(at, direction, left): (Vec3, Vec3, f32)| {
            let along = (at.z * radius + above) / -direction.z;
            let x = at.x * radius + direction.x * along;
            if direction.z < 0.0 && x.abs() < within {
                left
            } else {
                0.0
            }
        };
        area * exits.map(lands).sum::<f32>()
    };
    (0..rings).map(ring).sum()
}

fn a_ball_focuses_the_sun_as_rays_through_a_sphere_do(gpu: &mut Gpu) {
    gpu.look.photons.count = 1 << 14;
    let (radius, above) = (20.0, 50.0);
    let mut scene = floor(25.0, 68.0);
    let glass = clear_body(&mut scene, GLASS, 1.5);
    scene.ball(Vec3::Z * above, radius, 48, glass, true);
    scene.sun(Vec3::Z, PI, 0.001);
    let (pixels, _) = gpu.render(&scene, &with_caustics(reference()), 96);
    let side = 2.0 * 25.0 * 34f32.to_radians().tan() / SIDE as f32;
    for within in [5.0, 10.0, 16.0] {
        let lit = pixels.iter().zip(floor_points(&scene));
        let lit = lit.filter(|(_, p)| p.length() < within);
        let (count, sum) = lit.fold((0.0, 0.0), |(n, sum), (l, _)| (n + 1.0, sum + l.x));
        // the pixels whose middles lie in the circle, as a circle of their area
        let covered = (count * side * side / PI).sqrt();
        let exact = focused(radius, above, covered);
        let ratio = sum * side * side / exact;
        println!("{within}: {ratio}, mean L {}", sum / count);
        assert!((ratio - 1.0).abs() < 0.03, "{within}: {ratio}");
    }
}

fn glass_and_water_of_index_1_change_nothing(gpu: &mut Gpu) {
    gpu.look.photons.count = 1 << 14;
    let mut scene = Scene::new(Vec3::new(-90.0, -90.0, 40.0), Vec3::ZERO, 80.0, SIDE);
    let grey = scene.diffuse(0.6);
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), grey);
    let (glass, water) = (
        clear_body(&mut scene, GLASS, 1.0),
        clear_body(&mut scene, LIQUID, 1.0),
    );
    scene.block(
        Vec3::new(-30.0, -20.0, 20.0),
        Vec3::new(30.0, 60.0, 50.0),
        glass,
    );
    scene.quad(floor_at(-60.0, 99.9), water);
    for corner in [Vec3::new(-20.0, 0.0, 99.0), Vec3::new(50.0, 50.0, 99.0)] {
        scene.lamp(corner, 20.0, Vec3::splat(20.0));
    }
    scene.point(Vec3::new(-60.0, 60.0, -80.0), 2000.0, 4.0);
    let settings = bounced(2);
    let (straight, _) = gpu.render(&scene, &settings, 64);
    let (bent, _) = gpu.render(&scene, &with_caustics(settings), 64);
    let ratio = mean(&bent) / mean(&straight);
    println!("{ratio}");
    assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
}

fn frames_without_photons_have_the_same_bits(gpu: &mut Gpu) {
    let mut scene = floor(30.0, 60.0);
    scene.lamp(Vec3::new(-10.0, -10.0, 100.0), 20.0, Vec3::splat(5.0));
    let grey = scene.diffuse(0.5);
    scene.quad(ceiling_at(120.0, 400.0), grey);
    let live = Settings {
        rt_accumulate: false,
        ..bounced(1)
    };
    let mut same = |scene: &Scene, settings: &Settings| {
        let [off, on] = [settings.clone(), with_caustics(settings.clone())].map(|settings| {
            // random numbers of the first frame
            gpu.look = ViewTracer::new(&gpu.passes).expect("a device");
            gpu.count_rays(true);
            gpu.render(scene, &settings, 4)
        });
        assert!(
            gpu.rays()
                .is_some_and(|rays| rays[COUNT_PHOTONS as usize] == 0)
        );
        off == on
    };
    // a map without refracting bodies
    assert!(same(&scene, &bounced(1)));
    let glass = clear_body(&mut scene, GLASS, 1.5);
    scene.ball(Vec3::Z * 60.0, 20.0, 48, glass, true);
    // live frames
    assert!(same(&scene, &live));
    let on = gpu.render(&scene, &with_caustics(bounced(1)), 4);
    assert!(
        on != gpu.render(&scene, &bounced(1), 4),
        "a test of nothing"
    );
}
