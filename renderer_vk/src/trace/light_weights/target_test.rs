//! Compares the target function of the CPU with that of the shaders.

use super::super::lights::{point_light, sphere_bounds, triangle_bounds, triangle_light};
use super::tests::{lamp, listed};
use super::*;
use crate::gpu::{
    Access, Buffer, BufferDesc, BufferUsage, ComputePipeline, Device, DeviceOptions, FrameRing,
    Memory, SurfaceSource,
};
use bytemuck::{Pod, Zeroable};
use relight::light::{Falloff, PointLight, Spot};
use shaders::trace_types::constants as c;
use testkit::Random;

/// A point and its normal, as `shaders/test/light_target.comp` reads them.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Query {
    position: Vec3,
    normal: Vec3,
    light: u32,
}

#[test]
fn light_targets_match_the_shaders() {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    let made = Device::new(&options, SurfaceSource::Headless);
    let Some(device) = testkit::device(made) else {
        return;
    };
    let (queries, expected, bounds, triangles) = targets();
    let buffer = |name, memory, bytes: &[u8]| {
        let desc = BufferDesc {
            name,
            size: bytes.len() as u64,
            usage: BufferUsage::STORAGE,
            memory,
        };
        let buffer = Buffer::new(&device, &desc).unwrap();
        if memory == Memory::Upload {
            buffer.write(0, bytes).unwrap();
        }
        buffer
    };
    let upload = |name, bytes: &[u8]| buffer(name, Memory::Upload, bytes);
    let bounds = bounds.map(|bounds| upload("bounds", bytemuck::cast_slice(&bounds)));
    let triangles = upload("triangles", bytemuck::cast_slice(&triangles));
    let mut view = t::TraceView::default();
    view.lights.bounds[c::LIGHT_TRIANGLE as usize] = bounds[0].address();
    view.lights.bounds[c::LIGHT_SPHERE as usize] = bounds[1].address();
    view.lights.triangles[0] = triangles.address();
    view.lights.scale = 1.0;
    let view = upload("view", bytemuck::bytes_of(&view));
    let source = upload("queries", bytemuck::cast_slice(&queries));
    let mut found = vec![0.0f32; queries.len()];
    let target = buffer("targets", Memory::Readback, bytemuck::cast_slice(&found));
    let shader = &shaders::TEST_LIGHT_TARGET_COMP;
    let pipeline = ComputePipeline::new(&device, "light target", shader, &[]).unwrap();
    let mut ring = FrameRing::new(&device, 2).unwrap();
    let mut rec = ring.begin().unwrap();
    let mut pass = rec
        .pass("light target", Access::COMPUTE, Access::COMPUTE)
        .unwrap();
    pass.bind_compute(&pipeline);
    pass.push(&t::FilterStep {
        view: view.address(),
        source: source.address(),
        target: target.address(),
        spacing: queries.len() as u32,
        padding: 0,
    });
    pass.dispatch((queries.len() as u32).div_ceil(64), 1, 1);
    drop(pass);
    ring.end(rec).unwrap();
    device.wait_idle().unwrap();
    target
        .read(0, bytemuck::cast_slice_mut(&mut found))
        .unwrap();
    for ((query, expected), found) in queries.iter().zip(&expected).zip(&found) {
        let (position, normal, light) = (query.position, query.normal, query.light);
        let near = (found - expected).abs() <= 1e-4 * expected.abs() + 1e-6;
        assert!(
            near,
            "light {light:#x} at {position} to {normal}: {found}, not {expected}"
        );
    }
    let lit = expected.iter().filter(|&&e| e > 0.0).count();
    assert!(lit > queries.len() / 4, "{lit}");
    assert_eq!(device.validation_messages(), Vec::<String>::new());
}

type Targets = (
    Vec<Query>,
    Vec<f32>,
    [Vec<t::LightBounds>; 2],
    Vec<t::TriangleLight>,
);

/// Points around a one-sided triangle, a two-sided one, a point light and a spot; the expected values; the lights.
fn targets() -> Targets {
    let one_sided = lamp(Vec3::ZERO, Vec3::Z, 3.0);
    let two_sided = TriangleLight {
        two_sided: true,
        ..lamp(Vec3::X * 20.0, Vec3::new(1.0, 2.0, -1.0), 0.5)
    };
    let triangles = [one_sided, two_sided];
    let point = PointLight {
        origin: Vec3::new(-10.0, 5.0, 3.0),
        intensity: Vec3::new(900.0, 400.0, 100.0),
        radius: 4.0,
        spot: None,
        falloff: Falloff::InverseSquare,
        pulse: None,
    };
    let spot = PointLight {
        spot: Some(Spot {
            direction: Vec3::NEG_Z,
            tan_half_angle: 0.5,
        }),
        ..point
    };
    let spheres = [point, spot].map(|light| sphere_bounds(&point_light(&light, 0.0)));
    let on_gpu = triangles.map(|light| triangle_light(&light, 0.0, Vec3::ZERO));
    let mut listed: Vec<_> = triangles.iter().map(listed).collect();
    listed.extend(spheres.map(|bounds| Listed {
        number: 0,
        bounds,
        triangle: None,
        visibility: 1.0,
    }));
    let number = |i: usize| match i {
        0 | 1 => c::LIGHT_TRIANGLE << c::LIGHT_KIND_SHIFT | i as u32,
        _ => c::LIGHT_SPHERE << c::LIGHT_KIND_SHIFT | (i - 2) as u32,
    };
    let mut random = Random::new(7);
    let mut vector = |size: f32| Vec3::from_array([(); 3].map(|()| random.signed() * size));
    let (mut queries, mut expected) = (Vec::new(), Vec::new());
    for i in 0..4000 {
        // Near points, where triangles subtend large angles, and distant ones.
        let position = vector(if i % 2 == 0 { 12.0 } else { 200.0 });
        let normal = vector(1.0).normalize_or(Vec3::Z);
        let light = &listed[i % 4];
        if position.distance(light.bounds.centre) < 1.0 {
            continue;
        }
        let seen = light.seen_from(position, 0.0);
        expected.push(seen.map_or(0.0, |seen| seen.light * seen.cosine(normal)));
        queries.push(Query {
            position,
            normal,
            light: number(i % 4),
        });
    }
    let bounds = on_gpu.map(|light| triangle_bounds(&light)).to_vec();
    (
        queries,
        expected,
        [bounds, spheres.to_vec()],
        on_gpu.to_vec(),
    )
}
