//! Four vectors at once, one register for each axis (structure of arrays).

use glam::{Vec3, Vec4};

/// How many.
pub const WIDE: usize = 4;

/// Four vectors, an axis at a time.
pub type Four = [Vec4; 3];

/// Up to four vectors; zero for those that are not there.
pub fn four(vectors: impl Iterator<Item = Vec3>) -> Four {
    let mut axes = [Vec4::ZERO; 3];
    for (lane, vector) in vectors.take(WIDE).enumerate() {
        for (axis, value) in axes.iter_mut().zip(vector.to_array()) {
            axis[lane] = value;
        }
    }
    axes
}

/// The same one four times.
pub fn splat(vector: Vec3) -> Four {
    vector.to_array().map(Vec4::splat)
}

/// One of four vectors.
pub fn at(four: &Four, lane: usize) -> Vec3 {
    Vec3::from(four.map(|axis| axis[lane]))
}

/// Differences, lane by lane.
pub fn sub(a: &Four, b: &Four) -> Four {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Dot products, lane by lane.
pub fn dot(a: &Four, b: &Four) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross products, lane by lane.
pub fn cross(a: &Four, b: &Four) -> Four {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The bits of a mask.
pub fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (lane < WIDE as u32).then_some(lane as usize)
    })
}
