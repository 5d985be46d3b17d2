//! Clouds compared with the geometry of their sphere, and the sun's image with that of its square.

use glam::{Vec2, Vec3};
use shaders::trace_types::SkyRecord;
use shaders::types::constants as c;

use super::harness::{Gpu, Scene, encode, gpu_tests, identity, rectangle, reference, stage};
use crate::gpu::{Format, Image, ImageDesc, ImageUsage};
use crate::scene::Sun;
use crate::settings::Settings;

gpu_tests! {
    any: [
        clouds_are_as_sharp_as_a_pixel_is_small,
        the_sun_is_a_square_in_its_direction,
        visible_surfaces_behind_a_sky_are_shown,
    ],
}

/// Texels on each side of the image.
const SIDE: u32 = 1024;
/// Brightness step between levels of the image.
const STEP: u8 = 20;
const HEIGHT: f32 = 512.0;

/// An image whose levels encode their number.
fn levels(gpu: &Gpu) -> Image {
    let mut desc = ImageDesc::new("levels", SIDE, SIDE, Format::Rgba8, ImageUsage::SAMPLED);
    desc.mips = SIDE.ilog2() + 1;
    let image = Image::new(&gpu.device, &desc).expect("image");
    for mip in 0..desc.mips {
        let grey = STEP * u8::try_from(mip).expect("few levels");
        let side = (SIDE >> mip) as usize;
        let texels = [grey, grey, grey, 255].repeat(side * side);
        gpu.device
            .upload_image(&image, mip, 0, &texels)
            .expect("upload");
    }
    image
}

/// The clouds' coordinates: arc cosines of the direction from the centre of the sphere, 4096 below the camera.
fn coordinates(d: Vec3) -> Vec2 {
    let center = Vec3::new(0.0, 0.0, -4096.0);
    let (b, c) = (
        -center.dot(d),
        4096.0f32.powi(2) - (4096.0 + HEIGHT).powi(2),
    );
    let on_sphere = d * (-b + (b * b - c).sqrt());
    let v = (on_sphere - center).normalize();
    Vec2::new(v.x.acos(), v.y.acos())
}

fn clouds_are_as_sharp_as_a_pixel_is_small(gpu: &mut Gpu) {
    const SIZE: usize = 16;
    const FOV: f32 = 40.0;
    let image = levels(gpu);
    // at the zenith, half way, and near the horizon
    for elevation in [89.0f32, 45.0, 22.0] {
        let (sine, cosine) = elevation.to_radians().sin_cos();
        let forward = Vec3::new(cosine, 0.0, sine);
        let mut scene = Scene::new(Vec3::ZERO, forward * 100.0, FOV, SIZE as i32);
        scene.images.push(image.texture_index());
        let record = SkyRecord {
            faces: [c::NO_TEXTURE; 6],
            cloud_height: HEIGHT,
        };
        let sky = scene.sky(&[stage::image(0)], record);
        scene.room(Vec3::splat(-200.0), Vec3::splat(200.0), sky);
        let settings = Settings {
            rt_antialiasing: false,
            ..reference()
        };
        let (pixels, _) = gpu.render(&scene, &settings, 1);
        let tan = (FOV.to_radians() * 0.5).tan();
        let pixel = 2.0 * tan / SIZE as f32;
        let [_, left, up] = scene.def.view_axis;
        let d = (forward - (left + up) * (0.5 * pixel)).normalize();
        let h = 0.01;
        let aside = d.cross(Vec3::Y).normalize();
        let [a, b] = [aside, d.cross(aside)].map(|way| {
            let moved = coordinates((d + way * h).normalize());
            (moved - coordinates((d - way * h).normalize())) / (2.0 * h)
        });
        let texels = a.perp_dot(b).abs().sqrt() * pixel * SIDE as f32;
        let wanted = texels.log2();
        let found = encode(pixels[(SIZE + 1) * SIZE / 2].x) * 255.0 / f32::from(STEP);
        println!("{elevation} degrees: level {found}, {wanted}");
        assert!(wanted > 0.5, "a test of nothing");
        assert!(
            (found - wanted).abs() < 0.1,
            "{elevation}: {found} {wanted}"
        );
    }
}

fn the_sun_is_a_square_in_its_direction(gpu: &mut Gpu) {
    const SIZE: usize = 32;
    let direction = Vec3::new(0.8, 0.3, 0.5).normalize();
    let mut scene = Scene::new(Vec3::ZERO, Vec3::new(100.0, 30.0, 55.0), 30.0, SIZE as i32);
    let (blue, glow) = ([0.0, 0.0, 0.4], [0.6, 0.2, 0.2]);
    let record = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: HEIGHT,
    };
    let sky = scene.sky(&[stage::constant(blue)], record);
    scene.room(Vec3::splat(-200.0), Vec3::splat(200.0), sky);
    let material = scene.material(&[stage::add(glow)], c::MATERIAL_TRANSLUCENT);
    let settings = Settings {
        rt_antialiasing: false,
        ..reference()
    };
    let (pixels, _) = gpu.render_views(&scene, &settings, 1, |_, view| {
        view.sun = Some(Sun {
            material,
            direction,
        });
    });
    let tan = (15.0f32).to_radians().tan();
    let [forward, left, up] = scene.def.view_axis;
    let across = crate::scene::perpendicular(direction);
    let mut inside = 0;
    for (i, pixel) in pixels.iter().enumerate() {
        let at = |n: usize| ((n as f32 + 0.5) / SIZE as f32 * 2.0 - 1.0) * tan;
        let d = forward - left * at(i % SIZE) - up * at(i / SIZE);
        let d = d / d.dot(direction);
        // the square has a tenth of the distance to each side
        let far = [across, direction.cross(across)].map(|way| d.dot(way).abs());
        let far = far[0].max(far[1]);
        if (far - 0.1).abs() < 1.0e-4 {
            continue;
        }
        let in_it = far < 0.1;
        inside += usize::from(in_it);
        let channel = |n: usize| blue[n] + if in_it { glow[n] } else { 0.0 };
        for n in 0..3 {
            let found = encode(pixel[n]);
            assert!(
                (found - channel(n)).abs() < 0.01,
                "{i}: {found} {}",
                channel(n)
            );
        }
    }
    assert!(inside > 100 && inside < SIZE * SIZE / 2, "{inside}");
}

fn visible_surfaces_behind_a_sky_are_shown(gpu: &mut Gpu) {
    const SIZE: usize = 16;
    let colors = [
        [0.0, 0.0, 0.4],
        [0.6, 0.2, 0.2],
        [0.2, 0.6, 0.2],
        [0.8, 0.0, 0.8],
    ];
    let mut scene = Scene::new(Vec3::ZERO, Vec3::X * 100.0, 60.0, SIZE as i32);
    let record = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: HEIGHT,
    };
    let blue = scene.sky(&[stage::constant(colors[0])], record);
    let [red, green, violet] = [1, 2, 3].map(|i| scene.material(&[stage::constant(colors[i])], 0));
    // faces the camera, `half` to each side
    let wall = |x: f32, half: f32| {
        let edge = 2.0 * half;
        rectangle(Vec3::new(x, -half, -half), Vec3::Z * edge, Vec3::Y * edge)
    };
    // the second surface of the map and the third, in front of it, behind the first two, which are sky
    scene.quad(wall(100.0, 500.0), blue);
    scene.quad(wall(110.0, 500.0), blue);
    scene.quad(wall(200.0, 40.0), red);
    scene.quad(wall(150.0, 60.0), violet);
    scene.mesh(wall(300.0, 100.0), green, identity());
    let settings = Settings {
        rt_antialiasing: false,
        ..reference()
    };
    // colours in the middle of the picture, outside of the red wall, and outside of the green one
    for (potential, shown) in [
        (&[0u32, 1, 2, 3][..], [3, 3, 0]),
        (&[0, 1, 2], [1, 2, 0]),
        (&[0, 1], [2, 2, 0]),
        // no sky is in the visible set
        (&[2, 3], [0, 0, 0]),
    ] {
        let (pixels, _) = gpu.render_views(&scene, &settings, 1, |_, view| {
            view.look.potential = potential.to_vec();
        });
        for (x, color) in [8, 11, 15].into_iter().zip(shown) {
            let found = pixels[SIZE / 2 * SIZE + x].to_array().map(encode);
            let differs = found
                .iter()
                .zip(colors[color])
                .any(|(a, b)| (a - b).abs() > 0.01);
            assert!(!differs, "{potential:?} at {x}: {found:?}, not {color}");
        }
    }
    // moving geometry is visible only behind a sky, too, with its face to the camera
    let (pixels, _) = gpu.render_views(&scene, &settings, 1, |_, view| {
        view.look.potential = vec![0, 1, 2];
        view.meshes.clear();
    });
    let found = pixels[SIZE / 2 * SIZE + 11].to_array().map(encode);
    assert!((found[2] - colors[0][2]).abs() < 0.01, "{found:?}");
}
