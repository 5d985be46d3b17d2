//! Map conversion: a map, its materials and its images become a relit world.
//!
//! * [`bake`]: light of a world's sources, written into its map.
//! * [`mod@calibrate`]: fits lights to the lightmaps and places those that the compiler stripped.
//! * [`compare`]: image comparison.
//! * [`emitters`]: light sources in physical units.
//! * [`export`]: maps written for other programs.
//! * [`exposure`]: exposure of a map.
//! * [`files`]: game files behind one trait: packs, folders, an engine, memory.
//! * [`mod@image`]: texture images as the engine reads them.
//! * [`materials`]: scripts and implicit materials by name.
//! * [`overbright`]: overbright bits, gamma and sRGB.
//! * [`probe`]: rays into a map: the surface at a place, and the light that reaches it.
//! * [`sample`]: a small synthetic game for demonstrations and tests without game data.
//! * [`viewpoints`]: where players appear, and what they see there.
//! * [`world`]: a map with flat geometry, resolved materials and its light sources.
//! * [`light`]: light sources found in a map, and the lists of them per cluster.
//!
//! ```no_run
//! use relight::{Materials, RelitWorld, SearchPath};
//!
//! let files = SearchPath::open(&["/usr/share/games/openarena/baseoa"])?;
//! let (materials, _) = Materials::load(&files);
//! let world = RelitWorld::load(&files, &materials, "maps/oa_dm1.bsp", Default::default())?;
//! println!("{} lights, {} suns", world.lights.len(), world.suns.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic)
)]

pub mod bake;
mod cache;
pub mod calibrate;
pub mod compare;
pub mod curves;
pub mod emitters;
pub mod export;
pub mod exposure;
mod external_lightmaps;
pub mod files;
mod hand_written;
pub mod image;
pub mod light;
mod load;
mod map_files;
pub mod materials;
mod occluders;
pub mod overbright;
pub mod probe;
pub mod sample;
pub mod viewpoints;
pub mod world;

pub use cache::CalibrationCache;
pub use calibrate::{CalibrationOptions, calibrate, calibrate_with};
pub use emitters::{
    CalibrationReport, LightLists, LightReport, PointLight, SunLight, TriangleLight,
};
pub use external_lightmaps::external_lightmaps;
pub use files::{FileError, GameFiles, MemoryFiles, Overlay, Pak, Pk3, Precedence, SearchPath};
pub use hand_written::LineError;
pub use load::{LoadError, Options, Progress, Stage};
pub use map_files::map_files;
pub use materials::{Materials, Resolved};
pub use viewpoints::is_spawn_point;
pub use world::{RelitWorld, WorldMaterial, WorldSurface, WorldVertex};
