//! Alpha-tested surfaces.

use glam::Vec3;
use shaders::types::Stage;
use shaders::types::constants as c;

use super::harness::{
    Gpu, Scene, floor_at, floor_points, gpu_tests, reference, stage, through_byte,
};
use super::layers::{close, displayed, scene, screen};
use crate::gpu::{Format, Image, ImageDesc, ImageUsage};
use crate::trace::frame_lights::decode;

gpu_tests! {
    each: [
        cut_outs_have_holes_for_camera_and_shadow_rays,
        paint_with_holes_lets_its_wall_through,
    ],
}

/// An image of two texels beside each other.
pub(super) fn stripes(gpu: &Gpu, texels: [[u8; 4]; 2]) -> Image {
    let image = Image::new(
        &gpu.device,
        &ImageDesc::new("stripes", 2, 1, Format::Rgba8, ImageUsage::SAMPLED),
    )
    .expect("image");
    gpu.device
        .upload_image(&image, 0, 0, texels.as_flattened())
        .expect("upload");
    image
}

fn cut_outs_have_holes_for_camera_and_shadow_rays(gpu: &mut Gpu) {
    let image = stripes(gpu, [[255; 4], [255, 255, 255, 0]]);
    // left half white and solid, right half transparent
    let mut scene = scene();
    scene.images.push(image.texture_index());
    let back = [0.2, 0.4, 0.8];
    let wall = scene.material(&[stage::constant(back)], 0);
    scene.quad(screen(300.0), wall);
    let mut grate = stage::image(0);
    grate.alpha_func = c::ALPHAFUNC_GE128;
    let grate = scene.material(&[grate], c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED);
    // s runs along z, from below to above
    scene.quad(screen(100.0), grate);
    let (pixels, _) = gpu.render(&scene, &reference(), 1);
    let hole = Vec3::from(back.map(through_byte));
    for (row, color) in [(4, hole), (28, Vec3::ONE)] {
        for column in 0..32 {
            let pixel = pixels[row * 32 + column];
            assert!(close(pixel, color), "row {row}: {pixel}");
        }
    }
    // the same for a shadow: light from behind the grate passes only the hole
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 50.0), Vec3::ZERO, 60.0, 32);
    scene.images.push(image.texture_index());
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 100.0), white);
    let mut stripes = stage::image(0);
    stripes.alpha_func = c::ALPHAFUNC_GE128;
    let grate = scene.material(&[stripes], c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED);
    // above the camera; s runs along x: the hole is at x > 0
    scene.quad(floor_at(60.0, 100.0), grate);
    scene.sun(Vec3::Z, std::f32::consts::PI, 0.001);
    let (pixels, _) = gpu.render(&scene, &reference(), 2);
    for (pixel, p) in pixels.iter().zip(floor_points(&scene)) {
        if p.x.abs() > 3.0 {
            let exact = if p.x > 0.0 { 1.0 } else { 0.0 };
            assert!((pixel.x - exact).abs() < 0.002, "{p} {pixel}");
        }
    }
}

/// Nearly coplanar with its wall, as the depth offset of such a material requires: behind a ray that stopped at the
/// paint there would be no wall.
fn paint_with_holes_lets_its_wall_through(gpu: &mut Gpu) {
    let image = stripes(gpu, [[255, 128, 64, 255], [255, 128, 64, 0]]);
    let back = [0.2, 0.4, 0.3];
    let mut painted = Stage {
        blend_src: c::BLEND_DST_COLOR,
        blend_dst: c::BLEND_ZERO,
        ..stage::image(0)
    };
    painted.alpha_func = c::ALPHAFUNC_GE128;
    // doubles the brightness where the stage before it is drawn
    let doubled = Stage {
        blend_dst: c::BLEND_ONE,
        ..stage::filter([1.0; 3])
    };
    for (before, behind) in [(0.0, 0.0), (0.0005, 0.0), (0.0, 0.0005)] {
        let mut scene = scene();
        scene.images.push(image.texture_index());
        let paint = scene.material(
            &[painted, doubled],
            c::MATERIAL_CUT_OUT | c::MATERIAL_TRANSLUCENT | c::MATERIAL_POLYGON_OFFSET,
        );
        let wall = scene.material(&[stage::constant(back)], 0);
        // s runs along z, upwards
        scene.quad(screen(300.0 - before), paint);
        scene.quad(screen(300.0 - behind), wall);
        let (pixels, _) = gpu.render(&scene, &reference(), 1);
        let shown = displayed(back) * Vec3::new(255.0, 128.0, 64.0) / 255.0 * 2.0;
        for (row, color) in [(4, displayed(back)), (28, shown)] {
            for column in 0..32 {
                let pixel = pixels[row * 32 + column];
                let exact = decode(color);
                assert!(
                    close(pixel, exact),
                    "{before} {behind}, row {row}: {pixel} {exact}"
                );
            }
        }
    }
}
