//! The structures of the traced look that Rust and GLSL share. The build script writes them as
//! `generated/trace_types.glsl`, `layout(scalar)`. Radiance is linear; outgoing radiance 1 of a white diffuse surface
//! is display white. Positions and directions are in world space unless stated otherwise. Addresses are buffer device
//! addresses.

mod bake;
pub mod constants;
mod feedback;
mod frames;
mod lights;
mod photons;
mod structures;
mod surroundings;
mod vertex_light;
mod view;

use bytemuck::{Pod, Zeroable};

use crate::types::MaterialBuffers;

pub use bake::{
    BakeEstimate, BakeLight, BakePoint, BakePointLight, BakeStep, BakeTriangle, BakeView,
};
pub use feedback::FeedbackView;
pub use frames::{AntialiasView, DenoiseView, LastInstance, MotionView, ScreenView};
pub use lights::{
    BspNode, DynamicRow, EmittedLight, LightBounds, LightRow, LightSlot, LightTreeNode, LightView,
    ReservoirView, SphereLight, SunLight, TriangleLight,
};
pub use photons::{BodyTriangle, Photon, PhotonCell, PhotonView};
pub use structures::{
    BvhInstance, BvhNode, BvhTriangle, FilterStep, FirstHitsStep, GeometryRecord, GridRecord,
    HybridStep, ListStep, PassStep,
};
pub use surroundings::{
    CutOut, FlareView, FogView, MirrorPlane, PortalRecord, SkyRecord, TransportView,
};
pub use vertex_light::{LightGrid, VertexLightView, VertexSum};
pub use view::{CameraView, ExposureView, ImageView, PostView, SceneView, TargetView};

/// Parameters of one traced view: the traced size, and a block for each concern. Blocks with addresses come first,
/// which minimizes padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TraceView {
    /// 16 bytes a pixel that passes use in turns: primary hits, then sampled lights, then light being filtered.
    pub scratch: u64,
    /// Blue noise, `BLUE_NOISE_SIZE` squared floats from 0 to 1; 0: not in use.
    pub blue_noise: u64,
    /// Materials of all geometry that rays hit.
    pub materials: MaterialBuffers,
    /// Geometry, portals, skies, fog volumes.
    pub scene: SceneView,
    /// Lights and light lists.
    pub lights: LightView,
    /// Filters, boxes around layers, limits of paths.
    pub transport: TransportView,
    /// Photons of caustics.
    pub photons: PhotonView,
    /// Light samples of the last frame.
    pub reservoirs: ReservoirView,
    /// Light at vertices of the map.
    pub vertex_light: VertexLightView,
    /// Motion of surfaces.
    pub motion: MotionView,
    /// Counts of rays that meet bodies.
    pub feedback: FeedbackView,
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
    /// Light of the last frame for bounces.
    pub screen: ScreenView,
    /// Target of the finished picture.
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
    /// Seed of the random numbers: different for each frame.
    pub seed: u32,
    /// Frames in the accumulation image before this one.
    pub accumulated: u32,
}
