//! Textures on slanted surfaces compared with the mean of many samples.

use glam::Vec3;
use testkit::Random;

use super::harness::{Gpu, Scene, floor_at, reference, stage};
use crate::gpu::{Format, Image, ImageDesc, ImageUsage};
use crate::settings::Settings;
use crate::trace::tracer::Tracer;

/// Texels on each side of the image.
const SIDE: u32 = 256;

/// Random light and dark stripes of four texels along s, optionally with mip levels.
fn image(gpu: &Gpu, levels: bool) -> Image {
    let mut random = Random::new(1);
    let stripes: Vec<u8> = (0..SIDE / 4)
        .map(|_| {
            // low contrast: means of display values are then close to those of linear light
            if random.below(2) == 0 { 110 } else { 145 }
        })
        .collect();
    let mut level: Vec<u8> = (0..SIDE * SIDE)
        .map(|i| stripes[(i / SIDE / 4) as usize])
        .collect();
    let mut desc = ImageDesc::new("stripes", SIDE, SIDE, Format::Rgba8, ImageUsage::SAMPLED);
    desc.mips = if levels { SIDE.ilog2() + 1 } else { 1 };
    let image = Image::new(&gpu.device, &desc).expect("image");
    let mut side = SIDE as usize;
    for mip in 0..desc.mips {
        let rgba: Vec<u8> = level.iter().flat_map(|&g| [g, g, g, 255]).collect();
        gpu.device
            .upload_image(&image, mip, 0, &rgba)
            .expect("upload");
        let half = (side / 2).max(1);
        let texel = |x: usize, y: usize| u32::from(level[y * side + x]);
        level = (0..half * half)
            .map(|i| {
                let (x, y) = (2 * (i % half), 2 * (i / half));
                let (right, below) = ((x + 1).min(side - 1), (y + 1).min(side - 1));
                let sum = texel(x, y) + texel(right, y) + texel(x, below) + texel(right, below);
                u8::try_from((sum + 2) / 4).expect("a mean of bytes")
            })
            .collect();
        side = half;
    }
    image
}

/// A floor that shows the image, seen along the stripes.
fn floor(image: &Image) -> Scene {
    let mut scene = Scene::new(
        Vec3::new(-60.0, 0.0, 12.0),
        Vec3::new(60.0, 0.0, 0.0),
        50.0,
        64,
    );
    scene.images.push(image.texture_index());
    let material = scene.material(&[stage::image(0)], 0);
    scene.quad(floor_at(0.0, 64.0), material);
    scene
}

#[test]
fn anisotropy_comes_nearer_to_the_mean_of_many_samples() {
    // texture filtering does not depend on the tracer
    let Some(mut gpu) = Gpu::new(Tracer::Compute) else {
        return;
    };
    let gpu = &mut gpu;
    let (whole, levels) = (image(gpu, false), image(gpu, true));
    let (truth, _) = gpu.render(&floor(&whole), &reference(), 128);
    let mut error = |max_anisotropy: f32| {
        let scene = floor(&levels);
        let settings = Settings {
            anisotropic_filter: true,
            max_anisotropy,
            rt_antialiasing: false,
            ..reference()
        };
        let (pixels, _) = gpu.render(&scene, &settings, 1);
        let squares: Vec<f32> = pixels
            .iter()
            .zip(&truth)
            .map(|(p, t)| (p.x - t.x).powi(2))
            .collect();
        // of the whole picture, and of its lower quarter, where the ellipse is less than four times as long as wide
        let near = squares.len() * 3 / 4;
        [&squares[..], &squares[near..]].map(|s| s.iter().sum::<f32>() / truth.len() as f32)
    };
    let (none, two, eight) = (error(1.0), error(2.0), error(8.0));
    println!(
        "mean squared error, all and near: {none:?} without, {two:?} with 2, {eight:?} with 8"
    );
    assert!(eight[0] < 0.5 * none[0], "{eight:?} {none:?}");
    // Near, two look-ups are narrower than the one of the round footprint. Farther away each is as wide as that, so that
    // they reach along more of the ellipse, and as they stand side by side, stripes that lie aslant to it (at the sides
    // of the picture) are blurred a little more than by one: 2 % in the sum.
    assert!(two[1] < 0.85 * none[1], "{two:?} {none:?}");
    assert!(two[0] < 1.04 * none[0], "{two:?} {none:?}");
}
