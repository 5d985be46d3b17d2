//! The GPU layer: a thin, owning layer over `ash`. This is the only place of the renderer with `unsafe`.
//!
//! - **Ownership.** A [`Buffer`], [`Image`], pipeline or acceleration structure owns its parts and holds its
//!   [`Device`]. It can be dropped at any time: it is destroyed when the frames that may use it are over.
//! - **Frames.** [`FrameRing::begin`] returns a [`Recorder`], [`Recorder::pass`] returns a [`Pass`], and only a pass
//!   records work. Each pass begins with one barrier (`access.rs` has the rule) and is timed.
//! - **Resources.** One descriptor set serves every pipeline: textures and storage images are 32-bit indices, buffers
//!   are device addresses in 128 bytes of push constants. `shaders/common/bindless.glsl` has the shaders' declarations.
//! - **Uploads** requested at any time run before the commands of the frame that is being recorded.
//!
//! Requires Vulkan 1.2; does not use dynamic rendering and synchronization2. No API with addresses and indices can
//! check that shaders use valid ones: a shader with a wrong address reads other GPU memory of this process or loses the
//! device, which is reported as [`Error::DeviceLost`].

#![allow(unsafe_code)]
#![warn(clippy::multiple_unsafe_ops_per_block)]

mod accel;
mod access;
mod arena;
mod bindless;
mod buffer;
mod compaction;
mod copy;
mod device;
mod draw;
mod draw_state;
mod dynamic_state;
mod error;
mod frame;
mod graveyard;
mod heap;
mod image;
mod instance;
mod memory;
mod pass;
mod pin;
mod pipeline;
mod pipeline_cache;
mod ray_tracing;
mod recorder;
mod render_pass;
mod select;
mod spirv;
mod swapchain;
mod timers;
mod tlas;
mod upload;
mod window;
mod window_format;

pub use accel::{Blas, BlasBuild, BlasFlags, BlasGeometry};
pub use access::Access;
pub use bindless::{Filter, MipFilter, SamplerDesc, Wrap};
pub use buffer::{Buffer, BufferDesc, BufferUsage, Memory};
pub use compaction::CompactedSizes;
pub use device::{Device, DeviceOptions};
pub use draw::{Rendering, Viewport};
pub use draw_state::{BlendFactor, ColorMask, Cull, DepthTest, Stencil, Topology};
pub use error::Error;
pub use frame::FrameRing;
pub use heap::give_back_freed_memory;
pub use image::{Format, Image, ImageDesc, ImageUsage, NO_INDEX};
pub use instance::{SurfaceSource, WindowSource};
pub use memory::{MemoryKind, MemoryUse};
pub use pass::Pass;
pub use pipeline::{ComputePipeline, GraphicsDesc, GraphicsPipeline};
pub(crate) use pipeline_cache::hash;
pub use pipeline_cache::is_pipeline_cache;
pub use ray_tracing::{HitGroup, RayTracingDesc, RayTracingPipeline};
pub use recorder::Recorder;
pub use select::{DeviceInfo, DeviceKind, RayTracingLimits};
pub use swapchain::{Presented, Swapchain, SwapchainDesc};
pub use tlas::{Instance, Tlas};
pub use window::{CreateSurface, Window};
pub use window_format::Encoding;

#[cfg(test)]
mod tests;
