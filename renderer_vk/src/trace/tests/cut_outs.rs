//! Alpha-tested surfaces.

use glam::Vec3;
use shaders::types::Stage;
use shaders::types::constants as c;

use super::harness::{
    Gpu, Scene, bounced, ceiling_at, floor_at, floor_points, gpu_tests, reference, stage,
    through_byte,
};
use super::layers::{close, displayed, scene, screen};
use crate::gpu::{Format, Image, ImageDesc, ImageUsage};
use crate::settings::Settings;
use crate::trace::frame_lights::decode;

gpu_tests! {
    each: [
        cut_outs_have_holes_for_camera_and_shadow_rays,
        paint_with_holes_lets_its_wall_through,
        scattered_light_passes_a_fence_by_its_coverage,
        shadow_rays_of_bounces_pass_a_fence_by_its_coverage,
        no_light_leaks_through_solids_near_a_fence,
    ],
    any: [
        without_cut_outs_all_modes_have_the_same_bits,
        indirect_light_of_a_forest_errs_within_bounds,
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

/// Reference settings with one bounce, of a value of `rt_cutouts`.
fn meeting(rt_cutouts: u32) -> Settings {
    Settings {
        rt_cutouts,
        ..bounced(1)
    }
}

/// Adds a black fence, solid in a half of its image, whose material has this mean coverage.
fn fence(scene: &mut Scene, image: &Image, points: [Vec3; 4], coverage: f32) {
    let mut holes = stage::image(scene.images.len() as u32);
    scene.images.push(image.texture_index());
    holes.alpha_func = c::ALPHAFUNC_GE128;
    let material = scene.material(&[holes], c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED);
    scene.coverages.insert(material, coverage);
    scene.quad(points, material);
    let first = scene.vertices.len() - 4;
    for vertex in &mut scene.vertices[first..] {
        vertex.st *= 200.0;
    }
}

/// A white floor seen from 30 units above, below a ceiling that shines.
fn under_shining_ceiling(scene: &mut Scene) -> f32 {
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 4000.0), white);
    let light = scene.material(&[stage::constant([0.8; 3])], 0);
    scene.quad(ceiling_at(150.0, 4000.0), light);
    through_byte(0.8)
}

/// The fence lets the part 1 - coverage of the light of its other side through: by its image, nothing, and by the mean
/// coverage of its material, which is another one to tell them apart.
fn scattered_light_passes_a_fence_by_its_coverage(gpu: &mut Gpu) {
    let image = stripes(gpu, [[0, 0, 0, 255], [0, 0, 0, 0]]);
    for coverage in [0.25, 0.7] {
        let mut scene = Scene::new(Vec3::new(0.0, 0.0, 30.0), Vec3::ZERO, 60.0, 32);
        let light = under_shining_ceiling(&mut scene);
        fence(&mut scene, &image, floor_at(60.0, 4000.0), coverage);
        for (mode, passes) in [(0, 0.5), (1, 0.0), (2, 1.0 - coverage), (3, 1.0 - coverage)] {
            let mean = gpu.mean(&scene, &meeting(mode), 64).x;
            println!(
                "rt_cutouts {mode}, coverage {coverage}: {:.4}",
                mean / light
            );
            assert!((mean / light - passes).abs() < 0.01, "{mode}: {mean}");
        }
    }
}

/// Light of a sun from below passes the fence to the ceiling, and back to a plate: (1 - coverage) squared.
fn shadow_rays_of_bounces_pass_a_fence_by_its_coverage(gpu: &mut Gpu) {
    let image = stripes(gpu, [[0, 0, 0, 255], [0, 0, 0, 0]]);
    let coverage = 0.3;
    let mut scene = Scene::new(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 60.0, 32);
    let white = scene.diffuse(1.0);
    scene.quad(floor_at(0.0, 8.0), white);
    scene.quad(ceiling_at(150.0, 4000.0), white);
    let sun = Vec3::new(0.8, 0.0, -0.6);
    scene.sun(sun, std::f32::consts::PI, 0.001);
    fence(&mut scene, &image, floor_at(100.0, 4000.0), coverage);
    for (mode, passes) in [
        (0, 0.25),
        (1, 0.0),
        (2, (1.0 - coverage).powi(2)),
        (3, (1.0 - coverage).powi(2)),
    ] {
        let mean = gpu.mean(&scene, &meeting(mode), 64).x / 0.6;
        println!("rt_cutouts {mode}: {mean:.4}");
        assert!((mean - passes).abs() < 0.02, "{mode}: {mean}");
    }
}

/// A fence that leans in a box of 60 units; black walls before, in, at the end of and behind the box.
fn no_light_leaks_through_solids_near_a_fence(gpu: &mut Gpu) {
    let image = stripes(gpu, [[0, 0, 0, 255], [0, 0, 0, 0]]);
    for height in [
        None,
        Some(38.0),
        Some(70.0),
        Some(99.99),
        Some(100.001),
        Some(102.0),
    ] {
        let mut scene = Scene::new(Vec3::new(0.0, 0.0, 30.0), Vec3::ZERO, 60.0, 32);
        let light = under_shining_ceiling(&mut scene);
        let mut leaning = floor_at(40.0, 4000.0);
        leaning[1].z += 60.0;
        leaning[2].z += 60.0;
        fence(&mut scene, &image, leaning, 0.25);
        if let Some(height) = height {
            let black = scene.diffuse(0.0);
            scene.quad(ceiling_at(height, 8000.0), black);
        }
        for mode in 0..=3 {
            let (pixels, _) = gpu.render(&scene, &meeting(mode), 8);
            let most = pixels
                .iter()
                .map(|pixel| pixel.max_element())
                .fold(0.0, f32::max);
            match height {
                Some(_) => assert!(most < 1e-4, "{height:?} {mode}: {most}"),
                // the light is there
                None => assert_eq!(most > 0.2 * light, mode != 1, "{mode}: {most}"),
            }
        }
    }
}

fn without_cut_outs_all_modes_have_the_same_bits(gpu: &mut Gpu) {
    let mut scene = Scene::hall(20.0, 0.6, 32);
    scene.lamp(Vec3::new(-60.0, -40.0, 115.0), 80.0, Vec3::splat(20.0));
    let exact = gpu.render(&scene, &meeting(0), 2).0;
    for mode in 1..=3 {
        assert_eq!(exact, gpu.render(&scene, &meeting(mode), 2).0, "{mode}");
    }
}

/// Twelve crowns of 32 leaves, solid in a half of their image, under a sun.
fn forest(gpu: &Gpu, keep: &mut Vec<Image>) -> Scene {
    let image = stripes(gpu, [[80, 160, 60, 255], [80, 160, 60, 0]]);
    let mut scene = Scene::new(
        Vec3::new(-380.0, 0.0, 60.0),
        Vec3::new(0.0, 0.0, 40.0),
        80.0,
        48,
    );
    scene.images.push(image.texture_index());
    keep.push(image);
    let ground = scene.diffuse(0.6);
    scene.quad(floor_at(0.0, 400.0), ground);
    scene.sun(Vec3::new(0.4, 0.3, 0.87), 6.0, 0.01);
    scene.ambient = Vec3::splat(0.05);
    let mut holes = stage::image(0);
    holes.alpha_func = c::ALPHAFUNC_GE128;
    let flags = c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED;
    let leaf = scene.material(&[holes, stage::light_over()], flags);
    scene.coverages.insert(leaf, 0.5);
    let mut random = testkit::Random::new(5);
    for crown in 0..12 {
        let [x, y] = [crown % 4, crown / 4].map(|n| n as f32);
        let middle = Vec3::new(x * 180.0 - 200.0, y * 180.0 - 180.0, 90.0);
        let first = scene.surfaces.len();
        for _ in 0..32 {
            let normal = random.signed_point().normalize();
            let u = normal.any_orthonormal_vector() * 50.0;
            let v = normal.cross(u);
            let center = middle + random.signed_point() * 45.0;
            scene.quad(
                super::harness::rectangle(center - (u + v) * 0.5, u, v),
                leaf,
            );
        }
        // one surface, as compilers store a model
        scene.surfaces.truncate(first + 1);
        scene.surfaces[first].index_count = 32 * 6;
    }
    scene
}

/// Light of one bounce without alpha tests: error of the mean, and of squares of 8 x 8 pixels (root mean square), over the
/// mean.
fn indirect_light_of_a_forest_errs_within_bounds(gpu: &mut Gpu) {
    let mut keep = Vec::new();
    let scene = forest(gpu, &mut keep);
    let frames = 128;
    let direct = gpu.render(&scene, &reference(), frames).0;
    let mut indirect = |mode| {
        let all = gpu.render(&scene, &meeting(mode), frames).0;
        let bounced = all
            .iter()
            .zip(&direct)
            .map(|(all, direct)| all.y - direct.y);
        let mut tiles = [0.0f32; 36];
        for (pixel, light) in bounced.enumerate() {
            tiles[pixel / 48 / 8 * 6 + pixel % 48 / 8] += light / 64.0;
        }
        tiles
    };
    let exact = indirect(0);
    let mean = exact.iter().sum::<f32>() / 36.0;
    assert!(mean > 0.01, "{mean}");
    let mut errors = Vec::new();
    for mode in 1..=3 {
        let differences: Vec<f32> = (indirect(mode).iter().zip(exact))
            .map(|(light, exact)| (light - exact) / mean)
            .collect();
        let error = differences.iter().sum::<f32>() / 36.0;
        let rms = (differences.iter().map(|d| d * d).sum::<f32>() / 36.0).sqrt();
        println!(
            "rt_cutouts {mode}: mean {:+.1} %, tiles {:.1} %",
            error * 100.0,
            rms * 100.0
        );
        errors.push((error, rms));
    }
    for ((error, rms), most) in errors.iter().zip([0.6, 0.3, 0.2]) {
        assert!(error.abs() < most && *rms < 2.0 * most, "{error} {rms}");
    }
}
