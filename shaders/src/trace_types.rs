//! The structures of the traced look that Rust and GLSL share. The build script writes them as
//! `generated/trace_types.glsl`, `layout(scalar)`. Radiance is linear, in units where a white diffuse surface of outgoing radiance 1
//! shows as display white; space is the world's unless said otherwise. Addresses are buffer device addresses.

pub mod constants;
mod frames;
mod lights;
mod structures;
mod surroundings;
mod view;

use bytemuck::{Pod, Zeroable};

use crate::types::MaterialBuffers;

pub use frames::{AntialiasView, DenoiseView, LastInstance, MotionView};
pub use lights::{
    BspNode, DynamicRow, LightBounds, LightRow, LightSlot, LightView, SphereLight, SunLight,
    TriangleLight,
};
pub use structures::{BvhInstance, BvhNode, BvhTriangle, GeometryRecord};
pub use surroundings::{FlareView, FogView, PortalRecord, SkyRecord, TransportView};
pub use view::{CameraView, ExposureView, ImageView, PostView, SceneView, TargetView};

/// All that the passes of one traced view read: the size that is traced, and a block for each concern. Blocks that hold
/// addresses come first, so that little needs padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TraceView {
    /// 16 bytes a pixel that passes use in turns: what the primary rays hit, then sampled lights, then light that is being
    /// filtered.
    pub scratch: u64,
    /// Materials of everything that rays meet.
    pub materials: MaterialBuffers,
    /// What rays meet.
    pub scene: SceneView,
    /// Lights and light lists.
    pub lights: LightView,
    /// What lies in the way of rays.
    pub transport: TransportView,
    /// Motion of surfaces.
    pub motion: MotionView,
    /// The denoiser's images.
    pub denoise: DenoiseView,
    /// Flares.
    pub flares: FlareView,
    /// Exposure.
    pub exposure: ExposureView,
    /// Bloom, debug views, ray counters.
    pub post: PostView,
    /// Jitter, lens, resolved picture.
    pub antialias: AntialiasView,
    /// Light in fog.
    pub fog: FogView,
    /// Images of the traced size.
    pub images: ImageView,
    /// Where the picture goes.
    pub target: TargetView,
    /// Camera of this frame.
    pub camera: CameraView,
    /// Camera of the last frame.
    pub last_camera: CameraView,
    /// Traced pixels in a row.
    pub width: u32,
    /// Rows of traced pixels.
    pub height: u32,
    /// `VIEW_*` bits.
    pub flags: u32,
    /// Seed of the random numbers: differs from frame to frame.
    pub seed: u32,
    /// Frames in the accumulation image before this one.
    pub accumulated: u32,
}
