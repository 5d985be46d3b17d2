//! Fog compared with closed forms.

use glam::Vec3;
use shaders::trace_types::SkyRecord;
use shaders::types::{Fog, constants as c};

use super::harness::{Gpu, Scene, gpu_tests, rectangle, reference, stage};
use super::layers::{TRANSLUCENT, close, displayed, screen};
use crate::settings::{DenoiserChoice, Settings};
use crate::trace::frame_lights::decode;

gpu_tests! {
    any: [
        fog_is_lit_by_what_lights_each_place_of_it,
        fog_covers_surfaces_that_are_stored_with_it_alone,
        fog_seen_from_above_counts_the_way_below_its_surface,
        fog_fades_layers_that_are_stored_with_it,
        skies_show_behind_fog_but_through_a_surface_that_is_drawn,
        clouds_are_behind_the_fog_that_their_sky_is_stored_with,
    ],
}

fn fog_is_lit_by_what_lights_each_place_of_it(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 1.0, 32);
    let black = scene.material(&[stage::constant([0.0; 3])], 0);
    scene.quad(screen(300.0), black);
    scene.surfaces[0].fog = 1;
    let depth = 400.0;
    scene.fogs.push(Fog {
        mins: Vec3::new(100.0, -500.0, -500.0),
        maxs: Vec3::new(200.0, 500.0, 500.0),
        plane: [0.0; 4],
        has_surface: 0,
        color: Vec3::new(0.2, 0.4, 0.6),
        depth,
        own_light: Vec3::ZERO,
    });
    // blended in display values over black; without a surface the whole distance counts, as in the engine
    let ambient = decode(Vec3::new(0.2, 0.4, 0.6) * (300.0f32 / depth).sqrt());
    let (origin, radius, intensity) = (Vec3::new(130.0, 0.0, 30.0), 4.0f32, 9000.0f32);
    scene.point(origin, intensity, radius);
    // the mean radiance over the sphere of directions, over what scatters at each place, shares the display as the fog's
    // own colour does
    let steps = 4000;
    let mut lit = 0.0;
    for i in 0..steps {
        let root = (i as f32 + 0.5) / steps as f32;
        let place = Vec3::X * (100.0 + root * root * 100.0);
        let squared = (origin - place).length_squared();
        let sine_squared = radius * radius / squared;
        let cosine = (1.0 - sine_squared).sqrt();
        // 1 - cos without cancellation
        let share = 0.5 * sine_squared / (1.0 + cosine);
        let radiance = intensity / (std::f32::consts::PI * radius * radius);
        lit += radiance * share / steps as f32;
    }
    let exact = ambient * lit;
    assert!(exact.y > 0.3 * ambient.y, "a test of nothing: {exact}");
    let filtered = Settings {
        rt_accumulate: false,
        rt_denoiser: DenoiserChoice::ASvgf,
        rt_taa: false,
        ..reference()
    };
    for (settings, frames, tolerance) in [(reference(), 16, 0.05), (filtered, 24, 0.1)] {
        let mean = gpu.mean(&scene, &settings, frames) - ambient;
        let error = ((mean - exact) / exact).abs().max_element();
        assert!(error < tolerance, "{mean} {exact}");
        // the mean light of the map is a part of the fog's colour, at most one half
        let own = Vec3::new(0.8, 0.2, 0.4);
        scene.fogs[0].own_light = own;
        let part = own.min(Vec3::splat(0.5));
        let exact = ambient * (1.0 - part) + exact * part / own;
        let mean = gpu.mean(&scene, &settings, frames);
        let error = ((mean - exact) / exact).abs().max_element();
        assert!(error < tolerance, "{mean} {exact}");
        scene.fogs[0].own_light = Vec3::ZERO;
    }
    // a screen between the light and the fog's nearer half; emissive surfaces are unlit
    let wall = scene.material(&[stage::constant([0.0; 3])], 0);
    scene.quad(
        rectangle(
            Vec3::new(0.0, -400.0, 10.0),
            Vec3::X * 400.0,
            Vec3::Y * 800.0,
        ),
        wall,
    );
    let dark = gpu.mean(&scene, &reference(), 2);
    assert!(close(dark, ambient), "{dark} {ambient}");
}

/// Fog from x = 100 to 200, below z = `top`.
fn slab(has_surface: u32, top: f32) -> Fog {
    Fog {
        mins: Vec3::new(100.0, -500.0, -500.0),
        maxs: Vec3::new(200.0, 500.0, top),
        plane: [0.0, 0.0, -1.0, -top],
        has_surface,
        color: Vec3::from(TINT),
        depth: 400.0,
        own_light: Vec3::ZERO,
    }
}

const TINT: [f32; 3] = [0.2, 0.4, 0.6];
const BACK: [f32; 3] = [0.9, 0.5, 0.3];

/// Display value behind fog of this length, by the engine's factor.
fn fogged(length: f32, shown: Vec3) -> Vec3 {
    let factor = (length / 400.0).min(1.0).sqrt();
    Vec3::from(TINT) * factor + shown * (1.0 - factor)
}

/// A wall at x = 300, perpendicular to the view; it and the camera are below the fog's surface.
fn wall_behind_fog() -> Scene {
    let camera = Vec3::new(0.0, 0.0, 50.0);
    let mut scene = Scene::new(camera, camera + Vec3::X * 100.0, 1.0, 4);
    let wall = scene.material(&[stage::constant(BACK)], 0);
    scene.quad(screen(300.0), wall);
    scene.fogs.push(slab(c::FOG_SURFACE, 250.0));
    scene
}

#[track_caller]
fn shows(gpu: &mut Gpu, scene: &Scene, displayed: Vec3) {
    let (mean, exact) = (gpu.mean(scene, &reference(), 1), decode(displayed));
    assert!(close(mean, exact), "{mean} {exact}");
}

fn fog_covers_surfaces_that_are_stored_with_it_alone(gpu: &mut Gpu) {
    let back = displayed(BACK);
    let mut scene = wall_behind_fog();
    // the map stores no fog for the surface behind the volume
    shows(gpu, &scene, back);
    // with stored fog, by the distance from a camera below the fog's surface, wherever the box is
    scene.surfaces[0].fog = 1;
    shows(gpu, &scene, fogged(300.0, back));
    // an invalid fog index
    scene.surfaces[0].fog = 2;
    shows(gpu, &scene, back);
}

fn fog_seen_from_above_counts_the_way_below_its_surface(gpu: &mut Gpu) {
    // a floor at z = -100, straight below the camera: 180 of 300 units are below the fog's surface at 80
    let mut scene = Scene::new(Vec3::Z * 200.0, Vec3::X * 0.01, 1.0, 4);
    let floor = scene.material(&[stage::constant(BACK)], 0);
    let (x, y) = (Vec3::X * 400.0, Vec3::Y * 400.0);
    scene.quad(rectangle(Vec3::new(-200.0, -200.0, -100.0), x, y), floor);
    scene.surfaces[0].fog = 1;
    scene.fogs.push(slab(c::FOG_SURFACE, 80.0));
    shows(gpu, &scene, fogged(180.0, displayed(BACK)));
    // a surface above that of the fog
    scene.fogs[0].plane[3] = 150.0;
    shows(gpu, &scene, displayed(BACK));
}

fn fog_fades_layers_that_are_stored_with_it(gpu: &mut Gpu) {
    let back = displayed(BACK);
    let left = 1.0 - (125.0f32 / 400.0).sqrt();
    let (veil, alpha) = ([0.1, 0.9, 0.1], 127.0 / 255.0);
    for (layer, exact) in [
        (
            stage::blend(veil, 0.5),
            displayed(veil) * (alpha * left) + back * (1.0 - alpha * left),
        ),
        (stage::add([0.1; 3]), displayed([0.1; 3]) * left + back),
        // stages that multiply the background are not faded
        (stage::filter(veil), displayed(veil) * back),
    ] {
        let mut scene = wall_behind_fog();
        let layer = scene.material(&[layer], TRANSLUCENT);
        scene.quad(screen(125.0), layer);
        scene.surfaces[1].fog = 1;
        shows(gpu, &scene, exact);
    }
}

fn skies_show_behind_fog_but_through_a_surface_that_is_drawn(gpu: &mut Gpu) {
    // from inside the fog, straight up: its surface is 60 units away, the sky above it
    let mut scene = Scene::new(
        Vec3::new(150.0, 0.0, 20.0),
        Vec3::new(150.0, 0.01, 500.0),
        1.0,
        4,
    );
    let record = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: 512.0,
    };
    let sky = scene.sky(&[stage::constant(BACK)], record);
    scene.room(Vec3::splat(-300.0), Vec3::splat(300.0), sky);
    for surface in &mut scene.surfaces {
        surface.fog = 1;
    }
    scene.fogs.push(slab(c::FOG_SURFACE, 80.0));
    let back = displayed(BACK);
    shows(gpu, &scene, back);
    scene.fogs[0].has_surface = c::FOG_SURFACE_DRAWN;
    shows(gpu, &scene, fogged(60.0, back));
    // no fog from above the surface, nor for rays that leave the volume at its side
    scene.def.view_origin.z = 200.0;
    shows(gpu, &scene, back);
    let forward = Vec3::new(2.0, 0.0, 1.0).normalize();
    scene.def.view_axis = [forward, Vec3::Y, forward.cross(Vec3::Y)];
    scene.def.view_origin.z = 20.0;
    shows(gpu, &scene, back);
}

fn clouds_are_behind_the_fog_that_their_sky_is_stored_with(gpu: &mut Gpu) {
    let record = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: 512.0,
    };
    // below the fog's surface, including cells on a side of the sky box below it
    let (camera, at) = (
        Vec3::new(150.0, 0.0, 20.0),
        Vec3::new(250.0, 0.0, 20.0 - 37.5),
    );
    // the engine draws clouds on a box at the far plane's distance / 1.75
    let distance = Scene::new(camera, at, 1.0, 4).view().view.sky_distance();
    let depth = 3.0 * distance;
    let cover = ((at - camera).length() / (at.x - camera.x) * distance / depth).sqrt();
    let (veil, alpha) = ([0.1, 0.9, 0.1], 127.0 / 255.0);
    let left = 1.0 - cover;
    for (clouds, exact) in [
        (stage::constant(BACK), displayed(BACK) * left),
        // blended stages fade before the fog is applied; nothing is behind them
        (
            stage::blend(veil, 0.5),
            displayed(veil) * (alpha * left) * left,
        ),
    ] {
        let mut scene = Scene::new(camera, at, 1.0, 4);
        let sky = scene.sky(&[clouds], record);
        scene.room(Vec3::splat(-300.0), Vec3::splat(300.0), sky);
        for surface in &mut scene.surfaces {
            surface.fog = 1;
        }
        let fog = Fog {
            depth,
            ..slab(c::FOG_SURFACE, 80.0)
        };
        scene.fogs.push(fog);
        shows(gpu, &scene, exact + fog.color * cover);
        // surfaces without a stored fog have none
        for surface in &mut scene.surfaces {
            surface.fog = 0;
        }
        let without = exact / left;
        let without = if clouds.blend_src == c::BLEND_SRC_ALPHA {
            without / left
        } else {
            without
        };
        shows(gpu, &scene, without);
    }
}
