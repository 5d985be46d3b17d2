//! Map conversion: a map, its materials and its images become a relit world.
//!
//! * [`compare`]: two pictures of one view compared.
//! * [`files`]: game files behind one trait: packs, folders, an engine, memory.
//! * [`mod@image`]: texture images as the engine reads them.
//! * [`overbright`]: the one place that knows overbright bits, gamma and sRGB.

#![forbid(unsafe_code)]

pub mod compare;
pub mod files;
pub mod image;
pub mod overbright;
#[cfg(test)]
mod test_data;

pub use files::{FileError, GameFiles, MemoryFiles, Pk3, SearchPath};
