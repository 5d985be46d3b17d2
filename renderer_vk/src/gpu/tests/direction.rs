//! Packed directions: the error is that of rounding, also along the axes.

use super::support::{collect, compute, device, finish, readback};
use crate::gpu::*;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use testkit::Random;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Kept {
    direction: [f32; 3],
    spare: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    directions: u64,
    count: u32,
    padding: u32,
}

/// Directions along the axes, in the planes between them, and random ones.
fn directions() -> Vec<Vec3> {
    let mut all = Vec::new();
    for i in 0..27 {
        let step = |n: i32| (n % 3 - 1) as f32;
        let v = Vec3::new(step(i), step(i / 3), step(i / 9));
        if v != Vec3::ZERO {
            all.push(v.normalize());
        }
    }
    let mut random = Random::new(1);
    all.extend((0..20_000).map(|_| random.signed_point().normalize()));
    // nearly along an axis
    all.extend(
        (0..2000).map(|_| {
            (random.signed_point() * Vec3::new(1.0e-7, 0.0, 1.0e-6) + Vec3::Y).normalize()
        }),
    );
    all
}

#[test]
fn packed_directions_round_trip() {
    let Some(device) = device(true) else {
        return;
    };
    let given: Vec<Kept> = (0u32..)
        .zip(directions())
        .map(|(i, direction)| Kept {
            direction: direction.to_array(),
            spare: i % 65536,
        })
        .collect();
    let pipeline =
        ComputePipeline::new(&device, "direction", &shaders::TEST_DIRECTION_COMP, &[]).unwrap();
    let bytes: &[u8] = bytemuck::cast_slice(&given);
    let kept = readback(&device, "directions", bytes.len());
    kept.write(0, bytes).unwrap();
    let count = u32::try_from(given.len()).unwrap();
    let push = Push {
        directions: kept.address(),
        count,
        padding: 0,
    };
    compute(&device, &pipeline, &push, count);
    let mut bytes = vec![0; bytes.len()];
    kept.read(0, &mut bytes).unwrap();
    for (was, is) in given.iter().zip(collect::<Kept>(&bytes)) {
        let off = Vec3::from(was.direction).distance(Vec3::from(is.direction));
        assert!(off < 8.0e-7, "{was:?} {is:?}: {off}");
        assert_eq!(was.spare, is.spare);
    }
    drop((kept, pipeline));
    finish(device);
}
