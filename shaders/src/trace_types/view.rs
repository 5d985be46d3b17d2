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
    /// To the left, scaled by the tangent of half the horizontal angle.
    pub left: Vec3,
    /// Up, scaled by the tangent of half the vertical angle.
    pub up: Vec3,
    /// Absorption of the liquid that the camera is in, per unit of length.
    pub absorption: Vec3,
    /// Width of a pixel's cone at distance 1.
    pub pixel_spread: f32,
    /// Of one eye of two: added to the horizontal coordinate of the picture (-1 to 1, left to right) for the direction of a
    /// ray.
    pub stereo_shift: f32,
}

/// What rays meet: addresses and lengths of arrays.
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
    /// Top [`BvhNode`](super::BvhNode)s of the compute tracer; 0: nothing.
    pub nodes: u64,
    /// A [`BvhInstance`](super::BvhInstance) for each leaf of those.
    pub placed: u64,
    /// Index of the top-level structure.
    pub top_level: u32,
    /// Number of fog volumes.
    pub fog_count: u32,
    /// Number of portals.
    pub portal_count: u32,
    /// Seconds.
    pub time: f32,
    /// Sampler for the images of sky boxes: clamped, with mip levels.
    pub sky_sampler: u32,
    /// Distance of the faces of the box that the engine draws a sky on, units.
    pub sky_distance: f32,
    /// The sun's picture.
    pub sun: SunDisc,
}

/// Bindless indices of the images of the traced size; their formats and writers: `trace/targets.rs` of the renderer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ImageView {
    /// RGBA32F: position, and view distance (negative: nothing to light).
    pub position: u32,
    /// RG32UI: packed normals of triangle and shading.
    pub surface: u32,
    /// RG32UI: what the light of the surface is multiplied by, and the radiance in front of it.
    pub shown: u32,
    /// RG32UI: as `shown`, of what a pixel does not show where reflection and refraction alternate.
    pub other: u32,
    /// R32UI: direct light.
    pub direct: u32,
    /// R32UI: bounced light.
    pub indirect: u32,
    /// RGBA16F: the picture; not written while frames are accumulated.
    pub composite: u32,
    /// RGBA32F: the mean of the accumulated frames.
    pub accumulation: u32,
    /// RGBA16F: how far the pixel's surface was from here in the last frame (pixels, right and down), view distance then
    /// (negative: it was not in the picture, or is unknown), and the pixel's mark (`motion.glsl`).
    pub motion: u32,
}

/// Exposure.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ExposureView {
    /// State of automatic exposure: current exposure and histogram.
    pub state: u64,
    /// Stops that the player adds.
    pub bias: f32,
    /// Stops at which the map looks as bright as the engine shows it.
    pub base: f32,
    /// Mean logarithm of luminance of a usual picture of the map, stops.
    pub usual: f32,
    /// How far automatic exposure moves to a brighter picture in this frame, 0..1.
    pub blend: f32,
    /// The same for a darker picture.
    pub blend_dark: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// The image that the finished picture is written to.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TargetView {
    /// Bindless index.
    pub image: u32,
    /// Place of the view, pixels from the left.
    pub x: i32,
    /// Pixels from the top.
    pub y: i32,
    /// Size of the image, pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// Channels that are written: 1 red, 2 green, 4 blue.
    pub channels: u32,
}

/// What the passes after the light read, and what passes count with.
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
    /// R32UI: rays of each pixel, or `NO_IMAGE`.
    pub image_rays: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
