//! Mirrors on the paths of bounced light: closed forms, and every way to find a lamp counted once.

use std::f32::consts::PI;

use glam::Vec3;
use shaders::trace_types::SkyRecord;
use shaders::types::Dielectric;
use shaders::types::constants as c;

use super::bounces::by_each_way;
use super::dielectrics::{LIQUID, fresnel, square};
use super::harness::{
    Gpu, Scene, bounced, ceiling_at, encode, floor_at, floor_points, gpu_tests, lambert, mirror_at,
    plane, rectangle, stage, through_byte,
};
use crate::gpu::Image;
use crate::scene::Portal;

gpu_tests! {
    any: [
        a_lamp_below_a_mirror_ceiling_lights_the_floor,
        a_point_light_shows_the_outline_of_the_mirror,
        the_sun_off_a_mirror_lights_the_shade,
        curved_and_flat_mirrors_reflect_the_same_light,
        the_suns_disc_is_met_by_chance,
        a_furnace_of_mirrors_keeps_its_energy,
        light_passes_portals,
        many_mirrors_are_sampled_by_their_size,
        water_and_panes_reflect_light_by_fresnel,
        bounces_share_light_between_both_sides_of_water,
    ],
    each: [
        one_lamp_in_a_hall_of_mirrors,
    ],
}

/// Distance of the floor and of the mirror above it.
const HEIGHT: f32 = 80.0;

/// An image of one grey, and its value in linear light.
fn grey_image(gpu: &Gpu, code: u8) -> (Image, f32) {
    let texels: Vec<u8> = [code, code, code, 255].repeat(4);
    (
        square(gpu, 2, &texels),
        through_byte(f32::from(code) / 255.0),
    )
}

/// A white floor seen from above by a narrow camera.
fn floor_in_sight() -> Scene {
    let mut scene = Scene::new(
        Vec3::new(0.0, 0.0, 30.0),
        Vec3::new(20.0, 0.0, 0.0),
        40.0,
        16,
    );
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 500.0), white);
    scene
}

/// The same below a mirror that reflects the grey of `image`.
fn floor_below_a_mirror(image: &Image) -> Scene {
    let mut scene = floor_in_sight();
    scene.images.push(image.texture_index());
    let mirror = scene.material(&[stage::constant([0.0; 3]), stage::shine(0)], 0);
    scene.quad(ceiling_at(HEIGHT, 500.0), mirror);
    scene
}

/// A lamp between floor and mirror that faces the mirror, and its mirror image, which faces the floor.
const LAMP: [[Vec3; 3]; 2] = [
    [
        Vec3::new(10.0, -15.0, 50.0),
        Vec3::new(40.0, -15.0, 50.0),
        Vec3::new(10.0, 15.0, 50.0),
    ],
    [
        Vec3::new(10.0, -15.0, 110.0),
        Vec3::new(40.0, -15.0, 110.0),
        Vec3::new(10.0, 15.0, 110.0),
    ],
];

/// Mean L of the floor in the light of a triangle.
fn lit_floor(scene: &Scene, lamp: [Vec3; 3], radiance: f32) -> f32 {
    let points: Vec<Vec3> = floor_points(scene).collect();
    let sum: f32 = (points.iter())
        .map(|p| lambert(*p, Vec3::Z, lamp, radiance))
        .sum();
    sum / points.len() as f32
}

fn is_near(what: &str, value: f32, exact: f32, error: f32) {
    println!("{what}: {value} {exact} ({})", value / exact);
    assert!(
        (value / exact - 1.0).abs() < error,
        "{what}: {value} {exact}"
    );
}

fn a_lamp_below_a_mirror_ceiling_lights_the_floor(gpu: &mut Gpu) {
    let (image, grey) = grey_image(gpu, 160);
    let mut scene = floor_below_a_mirror(&image);
    scene.light(LAMP[0], Vec3::splat(50.0));
    let exact = grey * lit_floor(&scene, LAMP[1], 50.0);
    // the second bounce adds nothing: the lamp is dark on the floor's side
    for bounces in [1, 2] {
        for (way, mean) in (by_each_way(gpu, &scene, &bounced(bounces), 64).iter()).enumerate() {
            is_near(&format!("{bounces}, {way}"), mean.x, exact, 0.01);
        }
    }
    assert_eq!(gpu.mean(&scene, &bounced(0), 1), Vec3::ZERO);
}

fn a_point_light_shows_the_outline_of_the_mirror(gpu: &mut Gpu) {
    // a mirror of finite size: the floor is lit where it sees the lamp's image in it; a low wall hides the lamp itself
    let (image, grey) = grey_image(gpu, 160);
    let mut scene = floor_in_sight();
    scene.images.push(image.texture_index());
    let mirror = scene.material(&[stage::constant([0.0; 3]), stage::shine(0)], 0);
    let corner = Vec3::new(50.0, -3.0, HEIGHT);
    scene.quad(rectangle(corner, Vec3::Y * 6.0, Vec3::X * 6.0), mirror);
    let black = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_TWO_SIDED);
    let corner = Vec3::new(40.0, -100.0, 0.0);
    scene.quad(rectangle(corner, Vec3::Z * 12.0, Vec3::Y * 200.0), black);
    let lamp = Vec3::new(80.0, 0.0, 20.0);
    scene.point(lamp, 90_000.0, 0.5);
    let behind = lamp.with_z(2.0 * HEIGHT - lamp.z);
    let (pixels, _) = gpu.render(&scene, &bounced(1), 64);
    let (mut lit, mut dark) = (0, 0);
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        let way = behind - p;
        let at = p + way * (HEIGHT / way.z);
        let outside = ((at.x - 53.0).abs() - 3.0).max(at.y.abs() - 3.0);
        if outside.abs() < 1.2 || p.x > 35.0 {
            continue; // a pixel sees both, or the wall
        }
        if outside > 0.0 {
            assert_eq!(pixel.x, 0.0, "{p}");
            dark += 1;
        } else {
            let squared = way.length_squared();
            let exact = grey * 90_000.0 / PI * way.z / squared.sqrt() / squared;
            is_near(&format!("{p}"), pixel.x, exact, 0.03);
            lit += 1;
        }
    }
    assert!(lit > 8 && dark > 20, "{lit} {dark}");
}

/// A small white floor below a large mirror: a sun below the horizon lights it by way of the mirror alone.
fn sunless_floor(image: &Image) -> Scene {
    let camera = Vec3::new(0.0, 0.0, 10.0);
    let mut scene = Scene::new(camera, Vec3::new(2.0, 0.0, 0.0), 20.0, 16);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 10.0), white);
    scene.images.push(image.texture_index());
    let mirror = scene.material(&[stage::constant([0.0; 3]), stage::shine(0)], 0);
    scene.quad(ceiling_at(15.0, 500.0), mirror);
    scene
}

fn the_sun_off_a_mirror_lights_the_shade(gpu: &mut Gpu) {
    let (image, grey) = grey_image(gpu, 200);
    let mut scene = sunless_floor(&image);
    scene.sun(Vec3::new(-0.8, 0.0, -0.6), 5.0, 0.01);
    let exact = grey * 5.0 / PI * 0.6;
    for mean in by_each_way(gpu, &scene, &bounced(1), 64) {
        is_near("sun", mean.x, exact, 0.01);
    }
}

/// Settings of a long reference picture.
const FRAMES: u32 = 512;

fn curved_and_flat_mirrors_reflect_the_same_light(gpu: &mut Gpu) {
    // light is sampled across a flat mirror; rays from a curved one have to meet the lamp
    let (image, grey) = grey_image(gpu, 160);
    for curved in [false, true] {
        let mut scene = floor_below_a_mirror(&image);
        scene.surfaces[1].curved = curved;
        let lamp = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_EMITTER);
        // far enough aside that it shades no light of the mirror
        let corner = Vec3::new(170.0, -100.0, 50.0);
        let [a, b, c, d] = rectangle(corner, Vec3::X * 130.0, Vec3::Y * 200.0);
        scene.quad([a, b, c, d], lamp);
        let triangles = [[a, b, c], [a, c, d]];
        for triangle in triangles {
            scene.light(triangle, Vec3::splat(4.0));
        }
        for light in &mut scene.lights {
            light.surface = 2;
        }
        let image = |p: Vec3| p.with_z(2.0 * HEIGHT - p.z);
        let exact: f32 = (triangles.iter())
            .map(|t| grey * lit_floor(&scene, t.map(image), 4.0))
            .sum();
        let mean = gpu.mean(&scene, &bounced(2), FRAMES).x;
        is_near(
            &format!("curved {curved}"),
            mean,
            exact,
            if curved { 0.03 } else { 0.005 },
        );
    }
}

fn the_suns_disc_is_met_by_chance(gpu: &mut Gpu) {
    // no light is sampled across a curved mirror: rays have to hit the wide disc
    let (image, grey) = grey_image(gpu, 200);
    let mut scene = sunless_floor(&image);
    let sky = scene.sky(
        &[],
        SkyRecord {
            faces: [c::NO_TEXTURE; 6],
            cloud_height: 512.0,
        },
    );
    scene.room(Vec3::splat(-3000.0), Vec3::splat(3000.0), sky);
    scene.surfaces[1].curved = true;
    scene.sun(Vec3::new(-0.8, 0.0, -0.6), 5.0, 0.15);
    // the mean cosine over the disc
    let exact = grey * 5.0 / PI * 0.6 * 0.5 * (1.0 + 0.15f32.cos());
    is_near("disc", gpu.mean(&scene, &bounced(2), FRAMES).x, exact, 0.03);
}

fn a_furnace_of_mirrors_keeps_its_energy(gpu: &mut Gpu) {
    // every wall emits e, reflects a and mirrors m: a white patch inside receives e (1 + (a + m) + (a + m)^2 + ...)
    let (image, grey) = grey_image(gpu, 160);
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 8.0), Vec3::new(0.1, 0.0, 0.0), 12.0, 16);
    scene.images.push(image.texture_index());
    let wall = scene.material(
        &[
            stage::light(),
            stage::filter([encode(0.4); 3]),
            stage::shine(0),
            stage::add([encode(0.25); 3]),
        ],
        0,
    );
    scene.room(Vec3::new(-100.0, -70.0, -2.0), Vec3::splat(100.0), wall);
    let white = scene.material(&[stage::light()], 0);
    let corner = Vec3::new(-2.0, -2.0, 0.0);
    scene.quad(rectangle(corner, Vec3::X * 4.0, Vec3::Y * 4.0), white);
    let [glow, albedo] = [0.25, 0.4].map(|v| through_byte(encode(v)));
    let part = albedo + grey;
    assert!(part < 0.9, "{part}");
    for bounces in [1, 2, 3, 8] {
        let exact = glow * (1.0 - part.powi(bounces)) / (1.0 - part);
        let mean = gpu.mean(&scene, &bounced(bounces as u32), 64).x;
        is_near(&format!("{bounces} bounces"), mean, exact, 0.01);
    }
}

fn light_passes_portals(gpu: &mut Gpu) {
    // a floor below a portal to another place, all around which a wall glows
    let mut scene = floor_in_sight();
    let portal = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
    scene.quad(ceiling_at(HEIGHT, 40_000.0), portal);
    let glow = scene.material(&[stage::constant([encode(0.6); 3])], 0);
    let far = Vec3::new(0.0, 0.0, -100_000.0);
    scene.room(far - 50_000.0, far + 50_000.0, glow);
    scene.portals.push(Portal {
        mirror: false,
        plane: plane(Vec3::NEG_Z, Vec3::Z * HEIGHT),
        surface_origin: Vec3::Z * HEIGHT,
        surface_axis: [Vec3::NEG_Z, Vec3::X, Vec3::NEG_Y],
        camera_origin: far,
        camera_axis: [Vec3::NEG_Y, Vec3::X, Vec3::Z],
        ..mirror_at(0.0, Vec3::X)
    });
    for mean in by_each_way(gpu, &scene, &bounced(2), 64) {
        is_near("portal", mean.x, through_byte(encode(0.6)), 0.01);
    }
    // as a mirror, it shows the dark floor
    scene.portals[0].mirror = true;
    assert_eq!(gpu.mean(&scene, &bounced(2), 4), Vec3::ZERO);
    // and a lamp between both
    scene.light(LAMP[0], Vec3::splat(50.0));
    let exact = lit_floor(&scene, LAMP[1], 50.0);
    is_near("mirror", gpu.mean(&scene, &bounced(1), 64).x, exact, 0.01);
}

fn many_mirrors_are_sampled_by_their_size(gpu: &mut Gpu) {
    // the ceiling's mirror among a hundred small ones that show nothing
    let (image, grey) = grey_image(gpu, 160);
    let mut scene = floor_below_a_mirror(&image);
    scene.light(LAMP[0], Vec3::splat(50.0));
    for i in 0..100 {
        let corner = Vec3::new(400.0 + i as f32, -5.0, 20.0);
        scene.quad(rectangle(corner, Vec3::Z * 10.0, Vec3::Y * 10.0), 1);
    }
    let exact = grey * lit_floor(&scene, LAMP[1], 50.0);
    is_near(
        "one of many",
        gpu.mean(&scene, &bounced(1), 256).x,
        exact,
        0.01,
    );
}

/// Glass or a liquid with this index of refraction above the floor.
fn layer_above(scene: &mut Scene, flags: u32, index: f32) {
    let layer = scene.material(&[stage::filter([1.0; 3])], flags | c::MATERIAL_REFLECTS);
    scene.materials[layer as usize].0.dielectric = Dielectric {
        index,
        scale: 1.0,
        ..Dielectric::default()
    };
    scene.quad(ceiling_at(HEIGHT, 40_000.0), layer);
}

fn water_and_panes_reflect_light_by_fresnel(gpu: &mut Gpu) {
    let glass = c::MATERIAL_GLASS | c::MATERIAL_TRANSLUCENT;
    // points on the lamp's mirror image, whose area is 450
    let [a, b, c] = LAMP[1];
    let steps = 12;
    let spots: Vec<Vec3> = (0..steps * steps)
        .map(|i| [i % steps, i / steps].map(|n| (n as f32 + 0.5) / steps as f32))
        .map(|[u, v]| a + (b - a) * (u.sqrt() * (1.0 - v)) + (c - a) * (u.sqrt() * v))
        .collect();
    for (what, flags, index) in [("water", LIQUID, 1.33), ("pane", glass, 1.5)] {
        let mut scene = floor_in_sight();
        layer_above(&mut scene, flags, index);
        scene.light(LAMP[0], Vec3::splat(50.0));
        let points: Vec<Vec3> = floor_points(&scene).collect();
        let reflected = |way: Vec3| {
            let cosine = way.z / way.length();
            let face = fresnel(cosine.acos(), index).expect("no total reflection");
            let share = if what == "pane" {
                2.0 * face / (1.0 + face)
            } else {
                face
            };
            share * cosine * cosine / way.length_squared()
        };
        let sum: f32 = (points.iter())
            .map(|p| spots.iter().map(|spot| reflected(spot - p)).sum::<f32>())
            .sum();
        let exact = 50.0 * 450.0 / PI * sum / (points.len() * spots.len()) as f32;
        for mean in by_each_way(gpu, &scene, &bounced(1), 64) {
            is_near(what, mean.x, exact, 0.01);
        }
    }
}

fn bounces_share_light_between_both_sides_of_water(gpu: &mut Gpu) {
    // a white patch in a glowing floor below water, under a glowing ceiling
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 8.0), Vec3::new(0.1, 0.0, 0.0), 12.0, 16);
    let [low, high] = [0.8, 0.1];
    let [floor, ceiling] =
        [low, high].map(|glow| scene.material(&[stage::constant([encode(glow); 3])], 0));
    scene.quad(floor_at(-0.5, 40_000.0), floor);
    scene.quad(ceiling_at(2.0 * HEIGHT, 40_000.0), ceiling);
    layer_above(&mut scene, LIQUID, 1.33);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 2.0), white);
    let steps = 10_000;
    let mirrored: f32 = (0..steps)
        .map(|i| {
            // uniform steps of the squared sine are uniform in 2 cos t sin t dt
            let squared = (i as f32 + 0.5) / steps as f32;
            fresnel(squared.sqrt().asin(), 1.33).expect("no total reflection") / steps as f32
        })
        .sum();
    let [low, high] = [low, high].map(|glow| through_byte(encode(glow)));
    let exact = mirrored * low + (1.0 - mirrored) * high;
    is_near("water", gpu.mean(&scene, &bounced(2), 256).x, exact, 0.01);
    // a last bounce cannot go on, and passes
    is_near("last", gpu.mean(&scene, &bounced(1), 16).x, high, 0.01);
}

fn one_lamp_in_a_hall_of_mirrors(gpu: &mut Gpu) {
    // floor and ceiling are mirrors; a white pillar is lit by all images of a lamp. By the method of images, with B
    // bounces those of up to B reflections; each costs a factor
    let (image, grey) = grey_image(gpu, 160);
    let mut scene = Scene::new(
        Vec3::new(-100.0, 0.0, 40.0),
        Vec3::new(0.0, 0.0, 40.0),
        20.0,
        16,
    );
    scene.images.push(image.texture_index());
    let mirror = scene.material(&[stage::constant([0.0; 3]), stage::shine(0)], 0);
    let glow = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_EMITTER);
    let white = scene.diffuse(1.0);
    scene.quad(ceiling_at(HEIGHT, 4000.0), mirror);
    scene.quad(floor_at(0.0, 4000.0), mirror);
    scene.quad(
        rectangle(Vec3::new(0.0, -40.0, 0.0), Vec3::Z * HEIGHT, Vec3::Y * 80.0),
        white,
    );
    // a wall of light behind the camera, from floor to ceiling
    let lamp = rectangle(
        Vec3::new(-300.0, -300.0, 0.0),
        Vec3::Y * 600.0,
        Vec3::Z * HEIGHT,
    );
    scene.quad(lamp, glow);
    let [a, b, c, d] = lamp;
    for triangle in [[a, b, c], [a, c, d]] {
        scene.light(triangle, Vec3::splat(2.0));
    }
    for light in &mut scene.lights {
        light.surface = 3;
    }
    // the images of the wall are walls above each other
    let part = |point: Vec3, storey: i32| -> f32 {
        let up = Vec3::Z * (HEIGHT * storey as f32);
        [[a, b, c], [a, c, d]]
            .map(|t| lambert(point, Vec3::NEG_X, t.map(|p| p + up), 2.0))
            .iter()
            .sum()
    };
    for bounces in [1, 4] {
        // a lamp behind one mirror takes one bounce, and behind n > 1 mirrors, which rays have to pass, one bounce more
        let images = if bounces == 1 { 1 } else { bounces - 1 };
        let side = 100.0 * 10.0f32.to_radians().tan();
        let exact: f32 = (0..256)
            .map(|i| {
                let along = |n: i32| side * ((n as f32 + 0.5) / 8.0 - 1.0);
                let point = Vec3::new(0.0, along(i % 16), 40.0 + along(i / 16));
                let behind = |n| grey.powi(n) * (part(point, n) + part(point, -n));
                part(point, 0) + (1..=images).map(behind).sum::<f32>()
            })
            .sum::<f32>()
            / 256.0;
        let mean = gpu.mean(&scene, &bounced(bounces as u32), 64).x;
        is_near(&format!("{bounces}"), mean, exact, 0.01);
    }
}
