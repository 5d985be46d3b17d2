//! Blocks of a view: camera, scene, images, exposure, target.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::types::SunDisc;

/// A camera.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CameraView {
    /// Position.
    pub origin: Vec3,
    /// Unit vector of the view direction.
    pub forward: Vec3,
    /// Left, scaled by the tangent of half the horizontal field of view.
    pub left: Vec3,
    /// Up, scaled by the tangent of half the vertical field of view.
    pub up: Vec3,
    /// Absorption of the liquid that contains the camera, per unit of length.
    pub absorption: Vec3,
    /// Width of a pixel's cone at distance 1.
    pub pixel_spread: f32,
    /// Distance of the near plane, units: what lies in front of it is not drawn.
    pub near: f32,
    /// Stereo offset of this eye: added to the picture's horizontal coordinate (-1 to 1, left to right) for the
    /// direction of a ray.
    pub stereo_shift: f32,
}

/// Scene data: addresses and lengths of arrays.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneView {
    /// A [`GeometryRecord`](super::GeometryRecord) for each geometry.
    pub geometries: u64,
    /// An [`Instance`](crate::types::Instance) for each instance.
    pub instances: u64,
    /// A [`Fog`](crate::types::Fog) for each fog volume.
    pub fogs: u64,
    /// A [`PortalRecord`](super::PortalRecord) for each portal of the view.
    pub portals: u64,
    /// A [`SkyRecord`](super::SkyRecord) for each sky material.
    pub skies: u64,
    /// A [`MappedVertex`](crate::types::MappedVertex) for each vertex of the map; 0: none are known.
    pub mapped_vertices: u64,
    /// Top-level [`BvhNode`](super::BvhNode)s of the compute tracer; 0: no geometry.
    pub nodes: u64,
    /// A [`BvhInstance`](super::BvhInstance) for each leaf entry of those.
    pub placed: u64,
    /// Bindless index of the top-level structure.
    pub top_level: u32,
    /// Number of fog volumes.
    pub fog_count: u32,
    /// Number of portals.
    pub portal_count: u32,
    /// Time of the view, seconds.
    pub time: f32,
    /// Sampler of sky box images: clamped, with mip levels.
    pub sky_sampler: u32,
    /// Distance of the faces of the box on which the engine draws a sky, units.
    pub sky_distance: f32,
    /// Image of the sun.
    pub sun: SunDisc,
}

/// Bindless indices of the images of the traced size; their formats and writers: `trace/targets.rs` of the renderer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ImageView {
    /// RG32UI: position relative to the ray through the pixel (`gbuffer.glsl`).
    pub position: u32,
    /// R16UI: lower bits of the view distance, and flags (`view_distance.glsl`).
    pub distance_tail: u32,
    /// RG32UI: packed normals of triangle and shading.
    pub surface: u32,
    /// RG32UI: albedo, and radiance in front of the surface.
    pub shown: u32,
    /// RG32UI: `shown` of the other field, where pixels alternate between reflection and refraction.
    pub other: u32,
    /// R32UI: direct light.
    pub direct: u32,
    /// R32UI: bounced light.
    pub indirect: u32,
    /// RGBA32UI: specular reflection of the surface (`specular_surface.glsl`); only where materials are rough.
    pub specular: u32,
    /// R32UI: its light, before the reflectance.
    pub specular_light: u32,
    /// RG32UI: the light joined with that of earlier frames (`specular_filter.glsl`).
    pub fresh_specular: u32,
    /// `fresh_specular` of the last frame; `NO_IMAGE` if that had none.
    pub last_specular: u32,
    /// RGBA16F: the picture; not written while frames are accumulated.
    pub composite: u32,
    /// RGBA32F: the mean of the accumulated frames.
    pub accumulation: u32,
    /// RGBA16F: offset to the surface's position in the last frame (pixels, right and down), view distance then
    /// (negative: outside of the picture, or unknown), and the pixel's mark (`motion.glsl`).
    pub motion: u32,
}

/// Exposure.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ExposureView {
    /// State of automatic exposure: current exposure and histogram.
    pub state: u64,
    /// Stops added by the player.
    pub bias: f32,
    /// Stops at which the map looks as bright as in the engine.
    pub base: f32,
    /// Mean logarithm of luminance of a usual picture of the map, stops.
    pub usual: f32,
    /// Fraction of the way to a brighter exposure in this frame, 0..1.
    pub blend: f32,
    /// Fraction of the way to a darker exposure in this frame, 0..1.
    pub blend_dark: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Target image of the finished picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TargetView {
    /// Bindless index.
    pub image: u32,
    /// Position of the view, pixels from the left.
    pub x: i32,
    /// Pixels from the top.
    pub y: i32,
    /// Size of the image, pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// Channels that are written: 1 red, 2 green, 4 blue.
    pub channels: u32,
    /// Brightest displayed value over white: 1 for an image of 8 bits a channel, more for one of half floats.
    pub peak: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Inputs of the passes after lighting, and ray counters.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PostView {
    /// Rays of each counted pass (`COUNT_*`), `COUNTER_ROWS` counters (`u32`) for each; 0: not counted.
    pub counters: u64,
    /// Texels of the bloom; 0: no bloom.
    pub bloom: u64,
    /// Two pairs of a sum over pixels (logarithms of their ticks) and the number of pixels; 0: no view of time.
    pub time_sums: u64,
    /// Part of the light that bloom spreads.
    pub bloom_strength: f32,
    /// `DEBUG_*`; 0: the picture.
    pub debug: u32,
    /// R32UI: rays of each pixel, or `NO_IMAGE`.
    pub image_rays: u32,
    /// R32UI: clock ticks of each pixel times `TIMED_FRAMES`, or `NO_IMAGE`.
    pub image_time: u32,
    /// Which pair of `time_sums` this frame writes: 0 or 1; it reads the other.
    pub time_turn: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
