//! Models: the light that the engine adds to them, and occlusion of the first-person weapon.

use glam::Vec3;
use shaders::trace_types::constants as t;
use shaders::types::{Instance, Stage, constants as c};

use super::harness::{Gpu, Scene, bounced, gpu_tests, identity, rectangle, reference, stage};
use super::layers::{displayed, screen};
use crate::settings::Settings;
use crate::trace::frame_lights::decode;

gpu_tests! {
    any: [
        models_have_the_light_that_the_engine_adds,
    ],
    each: [
        who_carries_a_weapon_casts_no_shadow_on_it,
        a_weapon_needs_no_ray_but_the_first,
        who_carries_a_weapon_is_not_in_the_way_of_bounced_light,
    ],
}

const PAINT: [f32; 3] = [0.8, 0.4, 0.2];

/// A texture under the light of a model.
fn lit() -> [Stage; 2] {
    let light = Stage {
        rgb_gen: c::RGBGEN_LIGHTING_DIFFUSE,
        ..stage::constant([1.0; 3])
    };
    [light, stage::filter(PAINT)]
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() < 3.0e-3
}

fn models_have_the_light_that_the_engine_adds(gpu: &mut Gpu) {
    let traced = 0.3;
    let scene_of = |stages: &[Stage], instance: Instance| {
        let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 40.0, 16);
        scene.ambient = Vec3::splat(traced);
        let skin = scene.material(stages, 0);
        scene.mesh(screen(100.0), skin, instance);
        scene
    };
    let added = 32.0 / 255.0;
    let model = Instance {
        ambient: Vec3::new(0.1, 0.2, 0.9) + added,
        directed: Vec3::new(0.5, 0.2, 0.0),
        // the screen faces the camera, at half of that light
        light_direction: Vec3::new(-0.5, 0.75f32.sqrt(), 0.0),
        added,
        ..identity()
    };
    let albedo = decode(displayed(PAINT));
    // display values are clamped at white
    let grid = Vec3::new(0.35, 0.3, 0.9);
    let more = decode((grid + added).min(Vec3::ONE)) - decode(grid);
    let mean = gpu.mean(&scene_of(&lit(), model), &reference(), 2);
    assert!(close(mean, albedo * (more + traced)), "{mean}");
    // neither unlit stages nor stages to which the engine adds no light
    let glow = [stage::constant(PAINT)];
    let mean = gpu.mean(&scene_of(&glow, model), &reference(), 2);
    assert!(close(mean, albedo), "{mean}");
    let unlit = Instance {
        flags: c::INSTANCE_UNLIT,
        ..model
    };
    let mean = gpu.mean(&scene_of(&lit(), unlit), &reference(), 2);
    assert!(close(mean, albedo * traced), "{mean}");
}

/// A first-person weapon that fills the picture.
fn armed() -> Scene {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 20.0, 16);
    let skin = scene.material(&lit(), 0);
    let weapon = Instance {
        flags: c::INSTANCE_FIRST_PERSON,
        ..identity()
    };
    scene.mesh(screen(100.0), skin, weapon);
    scene
}

/// The weapon in the light of a lamp above, with a roof of instance flags `flags` between them.
fn under_a_roof(flags: u32) -> Scene {
    let mut scene = armed();
    let black = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_TWO_SIDED);
    let corner = Vec3::new(-900.0, -900.0, 300.0);
    let roof = rectangle(corner, Vec3::X * 1800.0, Vec3::Y * 1800.0);
    let instance = Instance {
        flags,
        ..identity()
    };
    scene.mesh(roof, black, instance);
    scene.point(Vec3::new(0.0, 0.0, 500.0), 200_000.0, 8.0);
    scene
}

fn who_carries_a_weapon_casts_no_shadow_on_it(gpu: &mut Gpu) {
    // one light in two passes, and all lights in one
    for rt_num_random_dl in [1, 0] {
        let settings = Settings {
            rt_num_random_dl,
            ..reference()
        };
        let free = gpu.mean(&under_a_roof(c::INSTANCE_NO_SHADOW), &settings, 64);
        assert!(free.min_element() > 1.0e-3, "{free}");
        // the player's body does not occlude the weapon, all other geometry does
        let body = gpu.mean(&under_a_roof(c::INSTANCE_THIRD_PERSON), &settings, 64);
        assert!(
            (body / free - 1.0).abs().max_element() < 0.02,
            "{body} {free}"
        );
        let wall = gpu.mean(&under_a_roof(0), &settings, 4);
        assert_eq!(wall, Vec3::ZERO);
    }
}

fn a_weapon_needs_no_ray_but_the_first(gpu: &mut Gpu) {
    gpu.count_rays(true);
    gpu.render(&armed(), &reference(), 4);
    let rays = gpu.rays().expect("counted");
    gpu.count_rays(false);
    let pixels = 16 * 16;
    let of = |pass: u32| rays[pass as usize];
    assert_eq!(of(t::COUNT_PRIMARY_RAYS), pixels);
    assert_eq!(of(t::COUNT_PRIMARY), 0, "the pass of mirrors and layers");
}

fn who_carries_a_weapon_is_not_in_the_way_of_bounced_light(gpu: &mut Gpu) {
    // a glowing wall behind the camera, and a body between them
    let scene_of = |flags: u32| {
        let mut scene = armed();
        let glow = scene.material(&[stage::constant([1.0; 3])], c::MATERIAL_TWO_SIDED);
        scene.quad(screen(-60.0), glow);
        let black = scene.material(&[stage::constant([0.0; 3])], c::MATERIAL_TWO_SIDED);
        let body = Instance {
            flags,
            ..identity()
        };
        scene.mesh(screen(-40.0), black, body);
        scene
    };
    for bounces in [1, 2] {
        let settings = bounced(bounces);
        let seen = gpu.mean(&scene_of(c::INSTANCE_THIRD_PERSON), &settings, 64);
        let hidden = gpu.mean(&scene_of(0), &settings, 64);
        assert!(
            seen.min_element() > 0.02 && hidden.max_element() < 0.7 * seen.min_element(),
            "{seen} {hidden}"
        );
    }
}
