//! First hits by the rasterizer are those of rays.

use glam::{Mat3, Vec3};
use shaders::trace_types::SkyRecord;
use shaders::types::Instance;
use shaders::types::constants as c;

use super::cut_outs::stripes;
use super::harness::{
    Gpu, Scene, floor_at, gpu_tests, identity, mirror_at, rectangle, reference, stage, wall_at,
};
use super::layers::TRANSLUCENT;
use crate::settings::Settings;

gpu_tests! {
    each: [
        pictures_equal_those_of_rays,
        frames_with_a_lens_are_traced,
    ],
}

/// Settings of a reference picture whose samples are the middles of the pixels.
fn middles(settings: Settings) -> Settings {
    Settings {
        rt_antialiasing: false,
        ..settings
    }
}

/// The number of pixels that differ by more than 2 % of their light.
fn differing(a: &[Vec3], b: &[Vec3]) -> usize {
    let differ = |a: Vec3, b: Vec3| (a - b).abs().max_element() > 0.02 * a.max_element().max(0.02);
    a.iter().zip(b).filter(|(a, b)| differ(**a, **b)).count()
}

/// A hall with all that a camera's ray treats in its own way: holes, posters, coplanar pairs, culled sides, glass, a mirror,
/// a window to the sky, turned models, a weapon in front of a wall that it intersects, broken triangles.
fn hall(gpu: &Gpu, keep: &mut Vec<crate::gpu::Image>, size: i32) -> Scene {
    let image = stripes(gpu, [[255; 4], [255, 255, 255, 0]]);
    let mut scene = Scene::hall(20.0, 0.6, size);
    scene.images.push(image.texture_index());
    keep.push(image);
    scene.ambient = Vec3::splat(0.1);
    scene.lamp(Vec3::new(-60.0, -40.0, 115.0), 80.0, Vec3::splat(20.0));
    let red = [0.9, 0.1, 0.1];
    let mut holes = stage::image(0);
    holes.alpha_func = c::ALPHAFUNC_GE128;
    let grate = scene.material(&[holes], c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED);
    let corner = Vec3::new(-20.0, -60.0, -70.0);
    scene.quad(rectangle(corner, Vec3::Z * 60.0, Vec3::Y * 50.0), grate);
    let poster = scene.material(&[stage::constant(red)], c::MATERIAL_POLYGON_OFFSET);
    scene.quad(
        rectangle(
            Vec3::new(-100.0, -40.0, -80.0),
            Vec3::X * 60.0,
            Vec3::Y * 60.0,
        ),
        poster,
    );
    // one-sided: seen from the front, and from behind
    let sign = scene.material(&[stage::constant([0.1, 0.2, 0.9])], 0);
    let corner = Vec3::new(20.0, 40.0, -20.0);
    scene.quad(rectangle(corner, Vec3::Z * 40.0, Vec3::Y * 40.0), sign);
    let corner = Vec3::new(10.0, 90.0, -20.0);
    scene.quad(rectangle(corner, Vec3::Y * 40.0, Vec3::Z * 40.0), sign);
    // both sides of a banner, in one plane
    let back = scene.material(&[stage::constant([0.2, 0.8, 0.2])], 0);
    let corner = Vec3::new(-60.0, 60.0, 0.0);
    scene.quad(rectangle(corner, Vec3::Z * 40.0, Vec3::Y * 40.0), sign);
    scene.quad(rectangle(corner, Vec3::Y * 40.0, Vec3::Z * 40.0), back);
    let pane = scene.material(&[stage::blend([0.2, 0.4, 1.0], 0.4)], TRANSLUCENT);
    scene.quad(
        rectangle(
            Vec3::new(-90.0, -100.0, -40.0),
            Vec3::Z * 50.0,
            Vec3::Y * 40.0,
        ),
        pane,
    );
    let nothing = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: 512.0,
    };
    let sky = scene.sky(&[stage::constant([0.5, 0.6, 1.0])], nothing);
    scene.quad(
        rectangle(
            Vec3::new(199.0, -80.0, 20.0),
            Vec3::Z * 60.0,
            Vec3::Y * 120.0,
        ),
        sky,
    );
    let mirror = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
    scene.quad(
        rectangle(
            Vec3::new(150.0, 60.0, -60.0),
            Vec3::Z * 60.0,
            Vec3::Y * 60.0,
        ),
        mirror,
    );
    scene.portals.push(mirror_at(150.0, Vec3::NEG_X));
    let white = scene.diffuse(0.9);
    let turn = Mat3::from_rotation_z(0.7) * Mat3::from_rotation_x(0.5) * 0.8;
    let turned = Instance {
        axis: [turn.x_axis, turn.y_axis, turn.z_axis],
        origin: Vec3::new(0.0, -90.0, 20.0),
        ..identity()
    };
    let two_sided = scene.material(&[stage::light()], c::MATERIAL_TWO_SIDED);
    scene.mesh(wall_at(0.0, 25.0), two_sided, turned);
    scene.mesh(floor_at(-30.0, 15.0), white, identity());
    let weapon = Instance {
        flags: c::INSTANCE_FIRST_PERSON,
        origin: Vec3::new(60.0, 10.0, -40.0),
        ..identity()
    };
    // behind the wall at x = 40 by its place
    scene.mesh(wall_at(0.0, 20.0), white, weapon);
    let mut broken = wall_at(-100.0, 60.0);
    broken[2].y = f32::INFINITY;
    scene.mesh(broken, white, identity());
    scene
}

fn pictures_equal_those_of_rays(gpu: &mut Gpu) {
    let mut keep = Vec::new();
    let size = 96;
    let scene = hall(gpu, &mut keep, size);
    let most = (size * size) as usize / 200;
    let live = Settings {
        rt_accumulate: false,
        // without light, whose noise differs from frame to frame
        rt_illumination: false,
        ..reference()
    };
    // at rest; and in a live frame with the jitter of TAA
    for (settings, frames) in [(middles(reference()), 1), (live, 3)] {
        let [traced, drawn] = [false, true].map(|rt_first_hits| {
            let settings = Settings {
                rt_first_hits,
                ..settings.clone()
            };
            gpu.render(&scene, &settings, frames).0
        });
        let count = differing(&traced, &drawn);
        println!("{frames} frames: {count} of {} differ", traced.len());
        assert!(count < most, "{count}");
        let dark = traced.iter().filter(|p| p.max_element() < 1e-3).count();
        assert!(dark < traced.len() / 10, "the scene is lit: {dark}");
    }
    // the test sees a picture without the weapon, or one whose sample is half a pixel aside
    let settings = middles(reference());
    let (traced, _) = gpu.render(&scene, &settings, 1);
    let mut empty = hall(gpu, &mut keep, size);
    empty.meshes.remove(2);
    assert!(differing(&traced, &gpu.render(&empty, &settings, 1).0) > most);
}

/// The picture is that of rays to the bit, because it is.
fn frames_with_a_lens_are_traced(gpu: &mut Gpu) {
    let mut keep = Vec::new();
    let scene = hall(gpu, &mut keep, 32);
    let lens = Settings {
        rt_dof: true,
        ..middles(reference())
    };
    for settings in [lens, reference()] {
        let [traced, drawn] = [false, true].map(|rt_first_hits| {
            let settings = Settings {
                rt_first_hits,
                ..settings.clone()
            };
            gpu.render(&scene, &settings, 2).0
        });
        assert_eq!(traced, drawn);
    }
}
