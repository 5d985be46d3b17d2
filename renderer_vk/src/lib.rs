//! The renderer: a safe Rust API over Vulkan, independent of engines and C. `ffi` adapts it to engines, and `cli` uses
//! it directly.

#![deny(unsafe_code)]

pub mod api;
mod assets;
#[cfg(test)]
mod assets_tests;
mod at_once;
mod bake;
#[cfg(test)]
mod bake_tests;
mod error;
mod frame;
mod gpu;
mod half;
mod pacing;
pub mod path;
pub mod picture_files;
mod raster;
mod renderer;
pub mod report;
mod scene;
pub mod settings;
mod statistics;
mod stereo;
mod targets;
#[cfg(test)]
mod test_support;
mod trace;
mod world;

pub use assets::LoadedFont;
pub use bake::{BakeDevice, GatherOptions, GpuGather};
pub use error::Error;
pub use gpu::{
    CreateSurface, DeviceInfo, DeviceKind, Error as GpuError, RayTracingLimits, Window,
    WindowSource,
};
pub use renderer::{
    CpuTimes, FRAMES_IN_FLIGHT, FrameStats, Renderer, RendererOptions, map_options, probe,
};
pub use settings::{
    Anaglyph, DebugOutput, DenoiserChoice, HdrChoice, HitFeedback, LightSelection, Look,
    MapLightChoice, ModelShadows, Settings, TextureMode, TracerChoice,
};
pub use statistics::{
    Costs, Latency, LightCost, MemoryPurpose, MovingCost, PassCost, Spread, StructureCost,
};
pub use stereo::Eye;
pub use world::LightsChanged;
