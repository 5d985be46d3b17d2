//! What one frame leaves to the next: motion, the denoiser's history, antialiasing.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Where an instance of the view was in the last frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LastInstance {
    /// Axes then.
    pub axis: [Vec3; 3],
    /// Origin then.
    pub origin: Vec3,
    /// `LAST_*`: whether it was there at all.
    pub known: u32,
}

/// What the motion of surfaces since the last frame is found with.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MotionView {
    /// Vertices of what moves ([`crate::types::Vertex`]), in the space of their instances.
    pub vertices: u64,
    /// Their size in bytes.
    pub vertex_bytes: u64,
    /// For each of them its position in the last frame (`Vec3`), in the space of its instance then.
    pub last_positions: u64,
    /// A [`LastInstance`] for each instance of the view.
    pub last_instances: u64,
    /// For each portal of the view the [`PortalRecord`](super::PortalRecord) of the last frame.
    pub last_portals: u64,
    /// R16F: length of the way now, which the next frame reads, too.
    pub view_distance: u32,
    /// The same image of the last frame.
    pub last_view_distance: u32,
    /// 1: camera, mirrors and portals are where they were.
    pub still: u32,
    /// 1: no time has passed since the last frame.
    pub time_stands: u32,
}

/// What the denoiser's passes read: addresses of their texels, bindless indices of their images.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DenoiseView {
    /// Light of the frames before, filtered a little.
    pub history: u64,
    /// Light of this frame and those before.
    pub fresh: u64,
    /// Number of frames and variance of each pixel.
    pub past: u64,
    /// The same of the last frame.
    pub last_past: u64,
    /// `DENOISE_*` bits.
    pub flags: u32,
    /// Seed of the last frame's random numbers.
    pub last_seed: u32,
    /// A pixel of each stratum of the last frame: position, and which pixel it is.
    pub samples: u32,
    /// Its normals, light and length of path.
    pub sample_surfaces: u32,
    /// Which pixel of each stratum is lit as such a sample, and which sample.
    pub gradient_pixels: u32,
    /// Depth and normal of each stratum.
    pub stratum_guide: u32,
    /// Change and size of direct and indirect light around each stratum.
    pub gradient_sums: u32,
    /// The part of direct and indirect light that has changed, of each stratum.
    pub gradient: u32,
    /// Change of the inverse of depth from pixel to pixel.
    pub depth_gradient: u32,
    /// Change and size of the light of each stratum's own sample.
    pub gradient_samples: u32,
}

/// The camera's samples, and how they become the picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct AntialiasView {
    /// Where in its pixel every ray of the frame goes through, from the middle, traced pixels.
    pub jitter: Vec2,
    /// Size of the finished picture, pixels; the traced one may be smaller.
    pub output_width: u32,
    /// See `output_width`.
    pub output_height: u32,
    /// The linear picture that exposure and tone curve work on: RGBA32F while frames are accumulated, else RGBA16F.
    pub image_picture: u32,
    /// RGBA16F of the output's size: what is resolved over time, and how many frames' worth it is.
    pub image_resolved: u32,
    /// Texture of the last frame's.
    pub last_resolved: u32,
    /// Light of the last frame, as the denoiser left it: R32UI.
    pub last_light: u32,
    /// Linear sampler that clamps.
    pub sampler_index: u32,
    /// 1: there is a resolved picture of the last frame.
    pub history: u32,
    /// Radius of the lens, units; 0: a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane that is sharp, units along the view.
    pub focal_distance: f32,
    /// Size of what a ray sees of a texture, over that of a traced pixel: less where many rays make a pixel.
    pub texture_scale: f32,
    /// How much longer than wide the part of a texture may be that one look-up takes in; 1 and below: no longer.
    pub anisotropy: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
