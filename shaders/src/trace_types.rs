//! The structures of the traced look that Rust and GLSL share. The build script writes them as
//! `generated/trace_types.glsl`, `layout(scalar)`. Radiance is linear, in units where a white diffuse surface of outgoing radiance 1
//! shows as display white; space is the world's unless said otherwise. Addresses are buffer device addresses.

pub mod constants;
mod frames;
mod lights;
mod structures;
mod surroundings;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::types::{MaterialBuffers, SunDisc};

pub use frames::{AntialiasView, DenoiseView, LastInstance, MotionView};
pub use lights::{
    BspNode, DynamicRow, LightBounds, LightRow, LightSlot, LightView, SphereLight, SunLight,
    TriangleLight,
};
pub use structures::{BvhInstance, BvhNode, BvhTriangle, GeometryRecord};
pub use surroundings::{FlareView, FogView, PortalRecord, SkyRecord, TransportView};

/// What the passes after the light read, and what they count with.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PostView {
    /// Rays of each counted pass (`COUNT_*`), `COUNTER_ROWS` counters (`u32`) for each; 0: they are not counted.
    pub counters: u64,
    /// Texels of the bloom; 0: there is none.
    pub bloom: u64,
    /// Part of the light that bloom spreads.
    pub bloom_strength: f32,
    /// `DEBUG_*`; 0: the picture.
    pub debug: u32,
}

/// All that the passes of one traced view read: camera, arrays, images, settings. What holds addresses comes first, so
/// that nothing needs padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)] // counts and addresses of the arrays that the other structures describe; bindless image indices
pub struct TraceView {
    pub geometries: u64,
    pub instances: u64,
    pub fogs: u64,
    pub portals: u64,
    pub skies: u64,
    /// State of automatic exposure: histogram and current exposure.
    pub exposure: u64,
    /// 16 bytes a pixel that passes hand on to those after them: what the eye's rays meet first, then the light that each
    /// pixel asks for.
    pub texels: u64,
    /// Top hierarchy of the compute tracer; 0: nothing.
    pub bvh_nodes: u64,
    pub bvh_instances: u64,
    pub materials: MaterialBuffers,
    pub motion: MotionView,
    pub post: PostView,
    pub lights: LightView,
    pub transport: TransportView,
    pub flares: FlareView,
    pub denoise: DenoiseView,
    pub antialias: AntialiasView,
    pub fog: FogView,
    pub sun: SunDisc,
    /// Absorption of the liquid that the eye is in, per unit of length.
    pub eye_absorption: Vec3,
    pub eye: Vec3,
    pub forward: Vec3,
    /// Scaled by the tangent of half the horizontal angle.
    pub left: Vec3,
    /// Scaled by the tangent of half the vertical angle.
    pub up: Vec3,
    pub width: u32,
    pub height: u32,
    /// Place of the view in the target, pixels from the left and the top.
    pub target_x: i32,
    pub target_y: i32,
    /// Index of the top-level structure.
    pub scene: u32,
    /// `VIEW_*` bits.
    pub flags: u32,
    /// Of the random numbers: differs from frame to frame.
    pub seed: u32,
    /// Frames in the accumulation image before this one.
    pub accumulated: u32,
    /// Seconds.
    pub time: f32,
    /// Width of a pixel's cone at distance 1.
    pub pixel_spread: f32,
    /// Light everywhere, as radiance of a white diffuse surface.
    pub ambient: Vec3,
    /// Of one eye of two: what is added to the horizontal coordinate of the picture (-1 to 1, left to right) for the
    /// direction of a ray.
    pub eye_shift: f32,
    /// Channels of the target that are written: 1 red, 2 green, 4 blue.
    pub channels: u32,
    pub fog_count: u32,
    pub portal_count: u32,
    pub flare_count: u32,
    /// Mirrors and portals on a path.
    pub max_depth: u32,
    pub bounces: u32,
    pub image_position: u32,
    pub image_surface: u32,
    /// RG32UI: what the light of the surface is multiplied by, and what is in front of it.
    pub image_shown: u32,
    /// RG32UI: as `image_shown`, of what a pixel does not show where a reflection and what lies behind it are seen in turns.
    pub image_other: u32,
    pub image_direct: u32,
    pub image_indirect: u32,
    /// RGBA16F, of the traced size; not written while frames are accumulated.
    pub image_composite: u32,
    pub image_accumulation: u32,
    /// RGBA16F: how far the pixel's surface was from here in the last frame (pixels, right and down), length of the way
    /// to it then (negative: it was not in the picture, or nobody knows where), and the pixel's mark (`motion.glsl`).
    pub image_motion: u32,
    /// Storage image of the rays of each pixel (`R32Uint`), or `NO_IMAGE`.
    pub image_rays: u32,
    pub image_target: u32,
    /// Stops.
    pub exposure_bias: f32,
    /// Stops at which the map looks as bright as the engine shows it.
    pub exposure_base: f32,
    /// How bright a usual picture of the map is: mean logarithm of luminance, stops.
    pub exposure_middle: f32,
    /// How far automatic exposure moves to its aim in this frame, 0..1.
    pub exposure_blend: f32,
    /// The same for a picture that became darker.
    pub exposure_blend_dark: f32,
    pub target_width: u32,
    pub target_height: u32,
    /// Clamped, with mip levels: for the images of sky boxes.
    pub sky_sampler: u32,
    /// Distance of the faces of the box that the engine draws a sky on, units.
    pub sky_distance: f32,
    /// Camera of the last frame.
    pub last_eye: Vec3,
    pub last_forward: Vec3,
    pub last_left: Vec3,
    pub last_up: Vec3,
    pub padding: u32,
}
