//! Mirrors, portals, sky, ray visibility, and output of the picture.

use glam::Vec3;
use shaders::trace_types::SkyRecord;
use shaders::types::Instance;
use shaders::types::constants as c;

use super::harness::{
    Gpu, Scene, bounced, ceiling_at, encode, floor_at, gpu_tests, identity, mirror_at, plane,
    rectangle, reference, stage, through_byte, wall_at,
};
use crate::scene::Portal;
use crate::settings::Settings;
use crate::trace::frame_lights::decode;
use crate::trace::tracer::Tracer;

gpu_tests! {
    any: [
        a_mirror_shows_what_is_behind_the_camera_and_the_player,
        camera_facing_copies_are_hit_only_by_their_own_paths,
        back_faces_do_not_show,
        of_two_faces_in_one_plane_the_one_that_shows_is_met,
        the_sky_is_where_its_stages_say_and_lets_the_sun_in,
        display_white_keeps_its_brightness,
        an_open_shutter_takes_the_mean_of_what_passes,
        exposure_adapts_to_surfaces_alone,
        frames_can_be_made_again_bit_by_bit,
    ],
    each: [
        only_the_fronts_of_a_weapon_are_seen,
        a_portal_shows_what_its_camera_sees,
    ],
}

const RED: [f32; 3] = [0.9, 0.1, 0.1];
const GREEN: [f32; 3] = [0.1, 0.8, 0.2];
const BLUE: [f32; 3] = [0.2, 0.1, 1.0];

fn linear(color: [f32; 3]) -> Vec3 {
    Vec3::from(color.map(through_byte))
}

fn close(a: Vec3, b: Vec3) -> bool {
    // stored colours are quantized to a part of their largest channel, with stochastic rounding in reference mode
    (a - b).abs().max_element() < 5.0e-4 + b.max_element() / 256.0
}

/// The scene has one color in the mean.
#[track_caller]
fn shows(gpu: &mut Gpu, scene: &Scene, color: Vec3) {
    let mean = gpu.mean(scene, &reference(), 1);
    assert!(close(mean, color), "{mean}");
}

/// A rectangle at distance x that faces -x; with a negative distance it faces +x.
fn screen(x: f32) -> [Vec3; 4] {
    if x > 0.0 {
        wall_at(x, 900.0)
    } else {
        rectangle(
            Vec3::new(x, -900.0, -900.0),
            Vec3::Y * 1800.0,
            Vec3::Z * 1800.0,
        )
    }
}

fn a_mirror_shows_what_is_behind_the_camera_and_the_player(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let red = scene.material(&[stage::constant(RED)], 0);
    // a clean mirror: its single stage passes half of the reflection
    let mirror = scene.material(&[stage::filter([encode(0.5); 3])], c::MATERIAL_PORTAL);
    scene.quad(screen(-100.0), red);
    scene.quad(screen(50.0), mirror);
    scene.portals.push(mirror_at(50.0, Vec3::NEG_X));
    // a product of display values
    let byte = |v: f32| (v * 255.0 + 0.001).floor() / 255.0;
    let half = |color: [f32; 3]| decode(Vec3::from(color.map(byte)) * byte(encode(0.5)));
    shows(gpu, &scene, half(RED));
    // the mirror shows the body of the player, the weapon before the camera does not
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let blue = scene.material(&[stage::constant(BLUE)], 0);
    let body = Instance {
        flags: c::INSTANCE_THIRD_PERSON,
        ..identity()
    };
    scene.mesh(screen(-10.0), green, body);
    shows(gpu, &scene, half(GREEN));
    let weapon = Instance {
        flags: c::INSTANCE_FIRST_PERSON,
        ..identity()
    };
    scene.mesh(screen(-5.0), blue, weapon);
    shows(gpu, &scene, half(GREEN));
    // no more mirrors than the setting permits
    let shallow = Settings {
        rt_max_depth: 0,
        ..reference()
    };
    assert_eq!(gpu.mean(&scene, &shallow, 1), Vec3::ZERO);
    // without its portal entity it is an ordinary surface
    scene.portals.clear();
    assert_eq!(gpu.mean(&scene, &reference(), 1), Vec3::ZERO);
    // the weapon is drawn in front of walls that it penetrates, and the body is invisible to its own camera
    scene.mesh(screen(60.0), blue, weapon);
    shows(gpu, &scene, linear(BLUE));
}

fn only_the_fronts_of_a_weapon_are_seen(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let red = scene.material(&[stage::constant(RED)], 0);
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let blue = scene.material(&[stage::constant(BLUE)], 0);
    let weapon = Instance {
        flags: c::INSTANCE_FIRST_PERSON,
        ..identity()
    };
    // the wall is nearer than the back of a weapon that penetrates it
    scene.quad(screen(40.0), red);
    let [a, b, c, d] = screen(60.0);
    scene.mesh([d, c, b, a], green, weapon);
    shows(gpu, &scene, linear(RED));
    // and behind that back is a front
    scene.mesh(screen(80.0), blue, weapon);
    shows(gpu, &scene, linear(BLUE));
}

fn camera_facing_copies_are_hit_only_by_their_own_paths(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let red = scene.material(&[stage::constant(RED)], 0);
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let veil = scene.material(
        &[stage::blend(BLUE, 1.0)],
        c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
    );
    let white = scene.material(&[stage::constant([1.0; 3])], 0);
    let mirror = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
    scene.quad(screen(50.0), mirror);
    scene.quad(screen(-100.0), white);
    scene.portals.push(mirror_at(50.0, Vec3::NEG_X));
    let mut on_way = |scene: &mut Scene, x: f32, material: u32, paths: u8| {
        scene.mesh(screen(x), material, identity());
        scene.meshes.last_mut().unwrap().paths = paths;
        gpu.mean(scene, &reference(), 1)
    };
    // geometry for direct views is not visible in the mirror, solid or not
    let mean = on_way(&mut scene, -10.0, red, 1);
    assert!(close(mean, Vec3::ONE), "{mean}");
    let mean = on_way(&mut scene, -15.0, veil, 1);
    assert!(close(mean, Vec3::ONE), "{mean}");
    // neither are copies that face another mirror; copies that face this one are
    let mean = on_way(&mut scene, -20.0, red, 3);
    assert!(close(mean, Vec3::ONE), "{mean}");
    let mean = on_way(&mut scene, -40.0, veil, 2);
    assert!(close(mean, linear(BLUE)), "{mean}");
    let mean = on_way(&mut scene, -30.0, green, 2);
    assert!(close(mean, linear(GREEN)), "{mean}");
    // and these are invisible to direct rays
    let mean = on_way(&mut scene, 30.0, red, 2);
    assert!(close(mean, linear(GREEN)), "{mean}");
    let mean = on_way(&mut scene, 20.0, veil, 1);
    assert!(close(mean, linear(BLUE)), "{mean}");
    // a mirror in the mirror: its paths are numbered after those of one mirror
    scene.meshes.clear();
    scene.entities.clear();
    scene.quad(screen(-90.0), mirror);
    scene.portals.push(Portal {
        plane: plane(Vec3::X, Vec3::X * -90.0),
        surface_origin: Vec3::X * -90.0,
        camera_origin: Vec3::X * -90.0,
        surface_axis: [Vec3::X, Vec3::Y, Vec3::NEG_Z],
        camera_axis: [Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z],
        ..mirror_at(50.0, Vec3::NEG_X)
    });
    let mut on_way = |scene: &mut Scene, x: f32, material: u32, paths: u8| {
        scene.mesh(screen(x), material, identity());
        scene.meshes.last_mut().unwrap().paths = paths;
        gpu.mean(scene, &reference(), 1)
    };
    let two_sided = scene.material(&[stage::constant(RED)], c::MATERIAL_TWO_SIDED);
    let mean = on_way(&mut scene, -60.0, two_sided, 2 + 2 + 1);
    assert!(close(mean, linear(RED)), "{mean}");
    let mean = on_way(&mut scene, -50.0, green, 2);
    assert!(close(mean, linear(GREEN)), "{mean}");
}

fn a_portal_shows_what_its_camera_sees(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let portal = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let red = scene.material(&[stage::constant(RED)], 0);
    scene.quad(screen(50.0), portal);
    scene.quad(screen(-100.0), red);
    // the far camera is at (5000, 0, 0) and looks along +y, at a green wall
    scene.quad(
        rectangle(
            Vec3::new(4000.0, 300.0, -900.0),
            Vec3::X * 2000.0,
            Vec3::Z * 1800.0,
        ),
        green,
    );
    scene.portals.push(Portal {
        mirror: false,
        camera_origin: Vec3::new(5000.0, 0.0, 0.0),
        // surface axis 0 points to the camera; the direction into the surface (-axis 0) becomes +y
        camera_axis: [Vec3::NEG_Y, Vec3::X, Vec3::Z],
        ..mirror_at(50.0, Vec3::NEG_X)
    });
    shows(gpu, &scene, linear(GREEN));
}

fn back_faces_do_not_show(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let red = scene.material(&[stage::constant(RED)], 0);
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let two_sided = scene.material(&[stage::constant(BLUE)], c::MATERIAL_TWO_SIDED);
    let away = |x: f32| {
        let [a, b, c, d] = screen(x);
        [d, c, b, a]
    };
    scene.quad(screen(200.0), green);
    scene.quad(away(100.0), red);
    shows(gpu, &scene, linear(GREEN));
    scene.quad(away(150.0), two_sided);
    shows(gpu, &scene, linear(BLUE));
    let only_back = scene.material(&[stage::constant(RED)], c::MATERIAL_CULL_BACK);
    scene.quad(screen(60.0), only_back);
    shows(gpu, &scene, linear(BLUE));
    scene.quad(away(50.0), only_back);
    shows(gpu, &scene, linear(RED));
}

fn of_two_faces_in_one_plane_the_one_that_shows_is_met(gpu: &mut Gpu) {
    // no plane perpendicular to an axis, so that distances are rounded variously
    let normal = Vec3::new(-0.8, 0.47, -0.371).normalize();
    let across = normal.cross(Vec3::Z).normalize() * 400.0;
    let along = normal.cross(across);
    let middle = Vec3::new(130.7, 3.3, -9.1);
    let corner = middle - 0.5 * (across + along);
    let mut scene = Scene::new(Vec3::new(1.3, 0.7, 0.1), Vec3::X * 100.0, 50.0, 32);
    let red = scene.material(&[stage::constant(RED)], 0);
    let green = scene.material(&[stage::constant(GREEN)], 0);
    let blue = scene.material(&[stage::constant(BLUE)], 0);
    scene.quad(screen(500.0), green);
    // two quads whose backs are first and last, each with another diagonal
    let back = rectangle(corner, along, across);
    scene.quad(back, blue);
    scene.quad(rectangle(corner, across, along), red);
    let [a, b, c, d] = back;
    scene.quad([b, c, d, a], blue);
    let (pixels, _) = gpu.render(&scene, &reference(), 1);
    let wrong = pixels.iter().filter(|p| !close(**p, linear(RED)));
    assert_eq!(wrong.count(), 0);
}

fn the_sky_is_where_its_stages_say_and_lets_the_sun_in(gpu: &mut Gpu) {
    let mut scene = Scene::new(
        Vec3::new(0.0, 0.0, 50.0),
        Vec3::new(100.0, 0.0, 50.0),
        90.0,
        32,
    );
    // additive layers over the sky are added in display values
    let haze = [0.2, 0.4, 0.6];
    let shown: [f32; 3] = std::array::from_fn(|i| (BLUE[i] + haze[i]).min(1.0));
    let sky = scene.sky(
        &[stage::constant(BLUE), stage::add(haze)],
        SkyRecord {
            faces: [c::NO_TEXTURE; 6],
            cloud_height: 512.0,
        },
    );
    let white = scene.diffuse(1.0);
    scene.room(
        Vec3::new(-500.0, -500.0, 0.0),
        Vec3::new(500.0, 500.0, 400.0),
        sky,
    );
    scene.surfaces.remove(0);
    scene.quad(floor_at(0.0, 500.0), white);
    scene.sun(Vec3::Z, std::f32::consts::PI, 0.001);
    let (pixels, _) = gpu.render(&scene, &reference(), 2);
    assert!(
        close(pixels[4 * 32 + 16], linear(shown)),
        "{}",
        pixels[4 * 32 + 16]
    );
    assert!(
        (pixels[30 * 32 + 16].x - 1.0).abs() < 0.01,
        "{}",
        pixels[30 * 32 + 16]
    );
    // the sky is above the roof: shadow
    scene.quad(ceiling_at(300.0, 500.0), white);
    let (pixels, _) = gpu.render(&scene, &reference(), 2);
    assert_eq!(pixels[30 * 32 + 16], Vec3::ZERO);
    // quick sky
    let fast = Settings {
        fast_sky: 2,
        ..reference()
    };
    let (pixels, _) = gpu.render(&scene, &fast, 1);
    assert_eq!(pixels[15 * 32 + 16], Vec3::ZERO);
}

fn display_white_keeps_its_brightness(gpu: &mut Gpu) {
    for (value, expected) in [(0.05, 0.05), (0.5, 0.5), (1.0, 0.852_8)] {
        let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
        let wall = scene.material(&[stage::constant([encode(value); 3])], 0);
        scene.quad(screen(100.0), wall);
        let (_, picture) = gpu.render(&scene, &reference(), 1);
        let exact = encode(expected) * 255.0;
        for pixel in picture {
            assert!(
                (f32::from(pixel[0]) - exact).abs() < 1.6 && pixel[3] == 255,
                "{pixel:?} {exact}"
            );
        }
    }
    // one stop more
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
    let wall = scene.material(&[stage::constant([encode(0.1); 3])], 0);
    scene.quad(screen(100.0), wall);
    let brighter = Settings {
        rt_exposure: 1.0,
        ..reference()
    };
    let (_, picture) = gpu.render(&scene, &brighter, 1);
    assert!(
        (f32::from(picture[100][0]) - encode(0.2) * 255.0).abs() < 1.6,
        "{:?}",
        picture[100]
    );
}

fn exposure_adapts_to_surfaces_alone(gpu: &mut Gpu) {
    let automatic = Settings {
        rt_auto_exposure: true,
        ..reference()
    };
    // a lit wall, and an emissive square over its left half or none: display value of the wall on the right
    let mut shown = |value: f32, glow: Option<f32>| {
        let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 30.0, 16);
        scene.ambient = Vec3::ONE;
        let wall = scene.diffuse(value);
        scene.quad(screen(100.0), wall);
        if let Some(glow) = glow {
            let glow = scene.material(&[stage::constant([encode(glow); 3])], 0);
            let (up, left) = (Vec3::Z * 1800.0, Vec3::Y * 1800.0);
            scene.quad(rectangle(Vec3::new(90.0, 0.0, -900.0), up, left), glow);
        }
        let (_, picture) = gpu.render(&scene, &automatic, 1);
        f32::from(picture[8 * 16 + 12][0])
    };
    // dark views are brightened, but remain darker than bright ones
    let (dark, bright) = (shown(0.01, None), shown(0.1, None));
    let (fixed, lifted) = (encode(0.01) * 255.0, encode(0.0105) * 255.0);
    assert!(dark > lifted && dark < bright, "{dark} {bright}");
    // half as much if half of the picture glows, however brightly
    let halves = [0.001, 0.5].map(|glow| shown(0.01, Some(glow)));
    for half in halves {
        assert!(half > fixed + 0.2 && half < dark, "{half} {fixed} {dark}");
    }
    assert!((halves[0] - halves[1]).abs() < 1.1, "{halves:?}");
}

fn frames_can_be_made_again_bit_by_bit(gpu: &mut Gpu) {
    let mut scene = Scene::new(
        Vec3::new(-20.0, 10.0, 5.0),
        Vec3::new(50.0, 20.0, -30.0),
        90.0,
        16,
    );
    let wall = scene.diffuse(0.5);
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), wall);
    scene.light(
        [
            Vec3::new(0.0, 0.0, 90.0),
            Vec3::new(0.0, 20.0, 90.0),
            Vec3::new(20.0, 0.0, 90.0),
        ],
        Vec3::splat(9.0),
    );
    let settings = bounced(1);
    let (first, _) = gpu.render(&scene, &settings, 3);
    let (second, _) = gpu.render(&scene, &settings, 3);
    assert_eq!(first, second);
    assert!(first.iter().any(|p| p.x > 0.0));
}

#[test]
fn all_tracers_make_the_same_picture() {
    let (Some(mut pipeline), Some(mut compute)) =
        (Gpu::new(Tracer::Pipeline), Gpu::new(Tracer::Compute))
    else {
        return;
    };
    let mut scene = Scene::new(
        Vec3::new(-180.0, 10.0, 40.0),
        Vec3::new(50.0, 0.0, -10.0),
        80.0,
        64,
    );
    let grey = scene.diffuse(0.6);
    scene.room(
        Vec3::new(-200.0, -150.0, -80.0),
        Vec3::new(200.0, 150.0, 120.0),
        grey,
    );
    // many small objects, rotated and scaled, that cast shadows
    let veil = scene.material(
        &[stage::blend(BLUE, 0.4)],
        c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED,
    );
    for i in 0..60 {
        let at = Vec3::new(
            (i * 37 % 300) as f32 - 150.0,
            (i * 53 % 250) as f32 - 125.0,
            (i * 29 % 150) as f32 - 70.0,
        );
        let turn = glam::Mat3::from_rotation_y(i as f32)
            * glam::Mat3::from_rotation_z(i as f32 * 0.7)
            * (0.5 + 0.02 * i as f32);
        let instance = Instance {
            axis: [turn.x_axis, turn.y_axis, turn.z_axis],
            origin: at,
            ..identity()
        };
        let square = rectangle(Vec3::splat(-10.0), Vec3::X * 20.0, Vec3::Y * 20.0);
        scene.mesh(square, if i % 3 == 0 { veil } else { grey }, instance);
    }
    // a brush model away from its original position
    let first = scene.surfaces.len();
    scene.quad(wall_at(0.0, 20.0), grey);
    scene.surfaces[first].model = 1;
    scene.instances.push(Instance {
        origin: Vec3::new(-60.0, 40.0, 20.0),
        ..identity()
    });
    scene.submodels.push(crate::scene::Submodel {
        model: 1,
        instance: scene.instances.len() as u32 - 1,
    });
    let lamp = Vec3::new(0.0, 60.0, 110.0);
    scene.lamp(lamp, 60.0, Vec3::splat(12.0));
    let settings = bounced(2);
    let (a, _) = pipeline.render(&scene, &settings, 2);
    let (b, _) = compute.render(&scene, &settings, 2);
    let differing = |other: &[Vec3]| {
        let pairs = a.iter().zip(other);
        pairs
            .filter(|(a, b)| (**a - **b).abs().max_element() > 0.01 * a.max_element().max(0.1))
            .count()
    };
    println!("{} of {} pixels differ", differing(&b), a.len());
    // rays that graze an edge may hit or miss it
    assert!(differing(&b) < a.len() / 50, "{}", differing(&b));
    assert!(a.iter().filter(|p| p.x > 0.02).count() > a.len() / 2);
    if let Some(mut query) = Gpu::new(Tracer::Query) {
        let (c, _) = query.render(&scene, &settings, 2);
        println!("{} of {} pixels differ", differing(&c), a.len());
        // the driver's traversal of the same structures
        assert!(differing(&c) < a.len() / 200, "{}", differing(&c));
    }
}

fn an_open_shutter_takes_the_mean_of_what_passes(gpu: &mut Gpu) {
    // the camera moves along a wall of stripes: the blurred picture is the mean of the pictures at its eight places
    const FRAMES: u32 = 8;
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 40.0, 16);
    let [dark, bright] =
        [0.1, 0.7].map(|glow| scene.material(&[stage::constant([encode(glow); 3])], 0));
    scene.quad(screen(200.0), dark);
    for stripe in -20..20 {
        let corner = Vec3::new(100.0, 12.0 * stripe as f32, -100.0);
        let points = rectangle(corner, Vec3::Z * 200.0, Vec3::Y * 4.0);
        scene.quad(points, bright);
    }
    let place = |frame: u32| Vec3::Y * (1.3 * frame as f32);
    let mut exact = vec![Vec3::ZERO; 256];
    let without_taa = Settings {
        rt_taa: false,
        ..reference()
    };
    let mut sums = [0.0; 2];
    for frame in 0..FRAMES {
        scene.def.view_origin = place(frame);
        let (pixels, _) = gpu.render(&scene, &without_taa, 16);
        for (sum, pixel) in exact.iter_mut().zip(pixels) {
            *sum += pixel / FRAMES as f32;
        }
    }
    gpu.look.join_frames(16 * FRAMES);
    let (blurred, _) = gpu.render_path(&scene, &without_taa, 16 * FRAMES, |frame, def| {
        def.view_origin = place(frame / 16);
    });
    for (pixel, exact) in blurred.iter().zip(&exact) {
        // other samples of the pixels that an edge crosses
        assert!((pixel.x - exact.x).abs() < 0.04, "{pixel} {exact}");
        sums[0] += pixel.x;
        sums[1] += exact.x;
    }
    assert!((sums[0] / sums[1] - 1.0).abs() < 0.005, "{sums:?}");
    // stripes alone would be dark or bright
    let between = blurred.iter().filter(|p| p.x > 0.15 && p.x < 0.65).count();
    assert!(between > 200, "{between}");
}
