//! The renderer: a safe Rust API over Vulkan. It knows no engine and no C; `ffi` translates for engines and `cli`
//! uses it directly.

#![deny(unsafe_code)]

pub mod api;
pub mod assets;
mod at_once;
mod error;
mod frame;
pub mod gpu;
mod half;
pub mod path;
mod raster;
mod renderer;
pub mod scene;
pub mod settings;
mod statistics;
mod stereo;
mod targets;
#[cfg(test)]
mod test_support;
pub mod trace;
pub mod world;

pub use assets::is_texture_mode;
pub use error::Error;
pub use renderer::{CpuTimes, FrameStats, Renderer, RendererOptions, probe};
pub use settings::{LightSelection, MapLightChoice, Settings, TracerChoice};
pub use statistics::{Costs, MemoryPurpose, PassCost};
pub use stereo::Eye;
