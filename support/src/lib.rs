//! General tools, independent of maps and rendering.
//!
//! * [`aabb`]: axis-aligned boxes.
//! * [`blue_noise`]: numbers without low frequencies.
//! * [`bvh`]: bounding volume hierarchies over boxes.
//! * [`grid`]: uniform grids over triangles.
//! * [`parallel`]: a function of every item, on all cores.
//! * [`random`]: a small generator that gives the same numbers everywhere.
//! * [`hash`]: 128-bit names for results that are kept.
//! * [`simd4`]: four vectors at once.
//! * [`mod@slice`]: parts of lists that exist by construction.

#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

pub mod aabb;
pub mod blue_noise;
pub mod bvh;
pub mod grid;
pub mod hash;
pub mod parallel;
pub mod random;
pub mod simd4;
pub mod slice;

pub use aabb::Aabb;
