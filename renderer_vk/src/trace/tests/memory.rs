//! Memory of the images that are as large as the screen.

use glam::Vec3;
use shaders::types::Fog;

use super::harness::{Gpu, Scene, floor_at, gpu_tests};
use crate::gpu::MemoryKind;
use crate::settings::{DebugOutput, DenoiserChoice, Settings};

gpu_tests! {
    any: [
        images_of_the_screen_take_few_bytes_a_pixel,
    ],
}

/// Pixels along each edge: a multiple of the sizes that drivers pad images to.
const SIZE: i32 = 256;

/// Bytes of the traced look's images for each pixel.
fn bytes_per_pixel(gpu: &Gpu) -> f64 {
    let uses = gpu.device.memory_uses().into_iter();
    let images = uses.filter(|m| m.kind == MemoryKind::Target && m.label.starts_with("trace "));
    images.map(|m| m.bytes as f64).sum::<f64>() / f64::from(SIZE * SIZE)
}

fn images_of_the_screen_take_few_bytes_a_pixel(gpu: &mut Gpu) {
    let mut scene = Scene::new(Vec3::new(-100.0, 0.0, 80.0), Vec3::ZERO, 1.0, SIZE);
    let white = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 500.0), white);
    scene.surfaces[0].fog = 1;
    scene.fogs.push(Fog {
        mins: Vec3::new(-500.0, -500.0, -10.0),
        maxs: Vec3::new(500.0, 500.0, 40.0),
        color: Vec3::splat(0.5),
        depth: 400.0,
        ..Fog::default()
    });
    scene.point(Vec3::Z * 100.0, 9000.0, 4.0);
    let adaptive = Settings::default();
    assert!(adaptive.rt_denoiser == DenoiserChoice::ASvgf && adaptive.rt_taa);
    let sparse = Settings {
        rt_denoiser: DenoiserChoice::Sparse,
        ..Settings::default()
    };
    let plain = Settings {
        rt_denoiser: DenoiserChoice::None,
        rt_taa: false,
        ..Settings::default()
    };
    let reference = Settings {
        rt_accumulate: true,
        ..Settings::default()
    };
    let shows_normals = Settings {
        rt_debug: DebugOutput::Normals,
        ..Settings::default()
    };
    for (name, settings, most) in [
        ("adaptive", &adaptive, 126.0),
        ("sparse", &sparse, 109.0),
        ("plain", &plain, 101.0),
        ("reference", &reference, 109.0),
        ("debug", &shows_normals, 142.0),
        ("adaptive again", &adaptive, 126.0),
    ] {
        gpu.render(&scene, settings, 3);
        let bytes = bytes_per_pixel(gpu);
        assert!(bytes <= most, "{name}: {bytes} bytes a pixel");
    }
}
