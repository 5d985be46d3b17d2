//! Data that one frame passes to the next: motion, the denoiser's history, antialiasing.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// An instance of the view in the last frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LastInstance {
    /// Axes in the last frame.
    pub axis: [Vec3; 3],
    /// Origin in the last frame.
    pub origin: Vec3,
    /// `LAST_*`: whether it existed, and whether it has moved.
    pub known: u32,
}

/// Inputs for the motion of surfaces since the last frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MotionView {
    /// [`crate::types::Vertex`] array of moving geometry, in the space of its instances.
    pub vertices: u64,
    /// Size of `vertices` in bytes.
    pub vertex_bytes: u64,
    /// Position of each of these vertices in the last frame (`Vec3`), in the space of its instance then.
    pub last_positions: u64,
    /// A [`LastInstance`] for each instance of the view.
    pub last_instances: u64,
    /// For each portal of the view the [`PortalRecord`](super::PortalRecord) of the last frame.
    pub last_portals: u64,
    /// R16F: view distance of this frame, read by the next frame too.
    pub view_distance: u32,
    /// R16F: view distance of the last frame.
    pub last_view_distance: u32,
    /// 1: camera, mirrors and portals have not moved.
    pub still: u32,
    /// 1: no time has passed since the last frame.
    pub time_stands: u32,
}

/// Inputs of the denoiser's passes: addresses of texels, bindless indices of images.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DenoiseView {
    /// Light history: after the first filter step of the last frame, with number of frames and variance of the fresh
    /// light in place of its own variance.
    pub history: u64,
    /// Light of this frame, joined with the history.
    pub fresh: u64,
    /// Change and size of the light of each stratum's own sample, with its level and guide: 16 bytes a stratum.
    pub gradient_samples: u64,
    /// Change and size of direct and indirect light, summed around each stratum: 8 bytes a stratum.
    pub gradient_sums: u64,
    /// Light history of the other eye of this frame, in the same form; 0: none.
    pub other_eye: u64,
    /// `DENOISE_*` bits.
    pub flags: u32,
    /// Seed of the last frame's random numbers.
    pub last_seed: u32,
    /// Gradient sample of each stratum of the last frame: position and pixel.
    pub samples: u32,
    /// Its normals, light and view distance.
    pub sample_surfaces: u32,
    /// Pixel of each stratum that shades a gradient sample, and the sample's pixel in the last frame.
    pub gradient_pixels: u32,
    /// Depth and normal of each stratum.
    pub stratum_guide: u32,
    /// Relative change of direct and indirect light of each stratum.
    pub gradient: u32,
    /// Relative change of the inverse depth from pixel to pixel.
    pub depth_gradient: u32,
    /// R32UI: number of frames and variance of each pixel, which the last filter step puts into the history. Until the
    /// temporal pass writes them it holds bounced light.
    pub past: u32,
    /// R32UI, one texel for each cell of 2 × 2 pixels: 1 if it gathers bounced light in this frame.
    pub selected: u32,
    /// Distance at which the pictures of both eyes coincide, units.
    pub convergence: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// What bounces of the next frame take from this one; bindless indices of images.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ScreenView {
    /// RG32UI: albedo and emission of the first surface of each pixel.
    pub surface: u32,
    /// R32UI: its distance, and the least distance of the pixels around, as 16-bit floats.
    pub depth: u32,
    /// R32UI: the light that it sends in all directions.
    pub light: u32,
    /// Most samples of a ray.
    pub steps: u32,
    /// Thickness of a surface, widths of a pixel there.
    pub thickness: f32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Camera samples, and parameters of antialiasing.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct AntialiasView {
    /// Offset of the frame's camera rays from the centre of their pixel, traced pixels.
    pub jitter: Vec2,
    /// Size of the finished picture, pixels; the traced one may be smaller.
    pub output_width: u32,
    /// See `output_width`.
    pub output_height: u32,
    /// The linear picture, input of exposure and tone curve: RGBA32F while frames are accumulated, else RGBA16F.
    pub image_picture: u32,
    /// RGBA16F of the output's size: the resolved picture, and the number of frames in it.
    pub image_resolved: u32,
    /// Texture of the last frame's resolved picture.
    pub last_resolved: u32,
    /// R32UI: filtered light of the last frame.
    pub last_light: u32,
    /// Linear, clamped sampler.
    pub sampler_index: u32,
    /// 1: the resolved picture of the last frame is valid.
    pub history: u32,
    /// Radius of the lens, units; 0: a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus, units along the view.
    pub focal_distance: f32,
    /// Factor of texture footprints relative to a traced pixel: below 1 where a pixel accumulates many rays.
    pub texture_scale: f32,
    /// Largest ratio of length to width of a texture footprint; 1 and below: isotropic.
    pub anisotropy: f32,
    /// Strength of sharpening, 0 to 1; 0: none.
    pub sharpness: f32,
    /// R16F of the output's size: greatest luminance of the colour range, smoothed over time.
    pub maximum: u32,
    /// The same of the last frame.
    pub last_maximum: u32,
    /// Weight of `last_maximum`.
    pub maximum_kept: f32,
    /// RGBA16F of the traced size: mean of more samples of pixels without history (compressed YCoCg), and their
    /// number; 0: none.
    pub more_samples: u32,
    /// Rays for each of them, besides the pixel's own.
    pub more_rays: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}
