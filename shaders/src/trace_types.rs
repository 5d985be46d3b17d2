//! The structures of the traced look that Rust and GLSL share; `shaders/trace/types.glsl` has the same ones under the
//! same names, `layout(scalar)`. Radiance is linear, in units where a white diffuse surface of outgoing radiance 1
//! shows as display white; space is the world's unless said otherwise. Addresses are buffer device addresses.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use crate::types::{MaterialBuffers, SunDisc};

/// One geometry of the acceleration structures: found by a hit's instance custom index plus geometry index.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct GeometryRecord {
    /// [`crate::types::Triangle`]s, one for each primitive.
    pub triangles: u64,
    /// [`crate::types::Vertex`]es that the triangles index, in the space of the instance.
    pub vertices: u64,
    /// Instance of all its triangles, or `NO_INSTANCE`: each triangle names its own.
    pub instance: u32,
    /// `KIND_*`.
    pub kind: u32,
}

/// A triangle that gives light from the side where its corners go round counter-clockwise.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TriangleLight {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Radiance, the same in all directions.
    pub radiance: Vec3,
    /// `LIGHT_*` bits.
    pub flags: u32,
    /// L without shadows below which it gives nothing; 0 for a light without an end.
    pub end: f32,
}

/// A small sphere that gives light: a point light of the map or a dynamic light of the game.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SphereLight {
    /// Centre.
    pub origin: Vec3,
    /// Radius, above 0.
    pub radius: f32,
    /// Radiance of its surface.
    pub radiance: Vec3,
    /// What lies nearer to the centre than this casts no shadow (the model that carries the light).
    pub clearance: f32,
    /// Direction of a spot.
    pub axis: Vec3,
    /// Cosine of the angle to `axis` up to which a spot shines in full; -1 for no spot.
    pub cos_inner: f32,
    /// Cosine of the angle to `axis` from which on it is dark; -2 for no spot.
    pub cos_outer: f32,
    /// Radius of the ball of glowing gas that the sphere stands for: nearer to the centre than this it gives no more
    /// light than here. 0: there is none.
    pub core: f32,
    /// Where light that falls off linearly ends; 0 for light that falls off with the square of the distance.
    pub reach: f32,
    /// L without shadows below which it gives nothing; 0 for a light without an end.
    pub end: f32,
}

/// A far disc of light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SunLight {
    /// Unit vector towards its middle.
    pub direction: Vec3,
    /// Cosine of its angular radius.
    pub cos_angle: f32,
    /// Irradiance of a surface that faces it, divided by pi: what a white diffuse surface shows.
    pub irradiance: Vec3,
}

/// What choosing a light needs to know about it, without reading all of it: a ball around it and what leaves it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightBounds {
    /// Centre: of a triangle its centroid, so that it lies in the triangle's plane.
    pub centre: Vec3,
    /// Nothing of the light lies farther from the centre.
    pub radius: f32,
    /// Of a triangle: normal of the emitting side times area times luminance of the radiance. Of a sphere: direction of
    /// a spot times the cosine from which on it is dark, shifted by 2 so that it is never zero; zero without a spot.
    pub axis: Vec3,
    /// Of a sphere the luminance of its radiant intensity, above 0; of a triangle 0, or -1 if both sides shine.
    pub even: f32,
}

/// A slot of a row's alias table: two lights, of which a number in [0, 1) picks the first below `threshold`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightSlot {
    /// The light that the slot is for: each of a row's lights has one slot.
    pub light: u32,
    /// The other light.
    pub alias: u32,
    /// Chance of the first, given the slot.
    pub threshold: f32,
    /// Chance of the first when a slot is drawn evenly from the row.
    pub chance: f32,
    /// The same of the other light.
    pub alias_chance: f32,
    /// About which part of the light reaches the row's cluster, above 0.
    pub visibility: f32,
    /// The same of the other light.
    pub alias_visibility: f32,
    /// Makes the size a power of two, so that a slot lies in one sector of a cache line.
    pub padding: u32,
}

/// The list of a cluster: slots from `first` on.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct LightRow {
    /// First slot.
    pub first: u32,
    /// Number of slots: strong lights first.
    pub count: u32,
    /// Number of strong lights. The others have slots of their own after those of the row, to pick among them alone.
    pub strong: u32,
    /// 1 if suns can reach the cell.
    pub suns: u32,
    /// The cluster that the cell is a piece of; more than there are: none.
    pub cluster: u32,
}

/// The list of a cluster among the lights of this frame: entries of `LightView::dynamic_lights`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct DynamicRow {
    /// First entry.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
}

/// Light lists of a view. Arrays of two or four are by kind of light (`LIGHT_*`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightView {
    /// [`LightBounds`] by kind: triangles, changing triangles, spheres, changing spheres.
    pub bounds: [u64; 4],
    /// [`TriangleLight`]s that stay as they are, and those of this frame.
    pub triangles: [u64; 2],
    /// [`SphereLight`]s of the map, and those of this frame.
    pub spheres: [u64; 2],
    /// [`SunLight`]s.
    pub suns: u64,
    /// [`LightRow`] of each cell (a piece of a cluster); the last is for points in none, and holds all lights.
    pub rows: u64,
    /// [`LightSlot`]s.
    pub slots: u64,
    /// [`DynamicRow`] of each cluster; the last is for points in none.
    pub dynamic_rows: u64,
    /// Numbers of the lights of this frame, row by row.
    pub dynamic_lights: u64,
    /// [`BspNode`]s.
    pub nodes: u64,
    /// Cell of each leaf (`i32`).
    pub leaf_cells: u64,
    /// Where the walk to a cell begins, for each box of a grid over the map (`i32`: a node, or `-1 - leaf`).
    pub grid: u64,
    /// Number of nodes; 0: every point lies in no cluster.
    pub node_count: u32,
    /// Number of rows.
    pub row_count: u32,
    /// Number of dynamic rows; 0 without such lights.
    pub dynamic_row_count: u32,
    /// Number of suns.
    pub sun_count: u32,
    /// `LIGHTS_*` bits.
    pub flags: u32,
    /// `SELECT_*`.
    pub selection: u32,
    /// Estimates a pixel.
    pub samples: u32,
    /// Candidates of resampled selection.
    pub candidates: u32,
    /// Scale of the map's lights.
    pub scale: f32,
    /// Least corner of that grid.
    pub grid_origin: Vec3,
    /// Boxes per unit of length.
    pub grid_scale: f32,
    /// Boxes along each axis; zero: no grid.
    pub grid_size: [u32; 3],
}

/// A node of the map's tree.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BspNode {
    /// Plane: a point is in front where `xyz . p >= w`.
    pub plane: [f32; 4],
    /// Front and back child: a node, or `-1 - leaf`.
    pub children: [i32; 2],
}

/// A node of a bounding volume hierarchy: the boxes of up to four children, in steps of a grid of its own (after Ylitie,
/// Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Corner of the grid.
    pub origin: Vec3,
    /// Size of a step along each axis, above 0.
    pub step: Vec3,
    /// Of each axis the low sides of the children's boxes, one byte for each child, the first in the lowest byte.
    pub low: [u32; 3],
    /// The high sides.
    pub high: [u32; 3],
    /// Index of the child's node, or `BVH_LEAF` with the number of its entries less one and the first of them, or
    /// `BVH_NONE`.
    pub children: [u32; 4],
}

/// A triangle in the order of a hierarchy's leafs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhTriangle {
    /// First corner.
    pub a: Vec3,
    /// Second corner.
    pub b: Vec3,
    /// Third corner.
    pub c: Vec3,
    /// Index of the geometry's triangle.
    pub primitive: u32,
    /// Makes the size a multiple of 16, so that it is read in three pieces.
    pub padding: [u32; 2],
}

/// A placed hierarchy, in the order of the top hierarchy's leafs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhInstance {
    /// Its [`BvhNode`]s.
    pub nodes: u64,
    /// Its [`BvhTriangle`]s.
    pub triangles: u64,
    /// World to object, three rows.
    pub to_object: [[f32; 4]; 3],
    /// Index of the geometry record.
    pub geometry: u32,
    /// Rays see it when their mask shares a bit.
    pub mask: u32,
    /// `KIND_*`.
    pub kind: u32,
    /// Keeps the size a multiple of eight without hidden bytes.
    pub padding: u32,
}

/// A sky material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SkyRecord {
    /// Bindless textures of the box in the order rt bk lf ft up dn, or `NO_TEXTURE`.
    pub faces: [u32; 6],
    /// Height of the clouds, units.
    pub cloud_height: f32,
}

/// A portal or mirror; see `scene::Portal` of the renderer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PortalRecord {
    /// Plane of the surface: `xyz . p = w`.
    pub plane: [f32; 4],
    /// 1: reflects.
    pub mirror: u32,
    /// A point of the plane.
    pub surface_origin: Vec3,
    /// Frame of the plane.
    pub surface_axis: [Vec3; 3],
    /// Where `surface_origin` is seen from.
    pub camera_origin: Vec3,
    /// What the frame of the plane turns to.
    pub camera_axis: [Vec3; 3],
}

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
    /// For each portal of the view the [`PortalRecord`] of the last frame.
    pub last_portals: u64,
    /// R16F: length of the way now, which the next frame reads, too.
    pub path: u32,
    /// The same image of the last frame.
    pub last_path: u32,
    /// 1: camera, mirrors and portals are where they were.
    pub still: u32,
    /// 1: no time has passed since the last frame.
    pub time_stands: u32,
}

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
    pub carried: u32,
    /// Depth and normal of each stratum.
    pub stratum_guide: u32,
    /// Change and size of direct and indirect light around each stratum.
    pub gradient_sums: u32,
    /// The part of direct and indirect light that has changed, of each stratum.
    pub gradient: u32,
    /// Change of the inverse of depth from pixel to pixel.
    pub slope: u32,
    /// Change and size of the light of each stratum's own sample.
    pub gradient_samples: u32,
}

/// What lies in the way of light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransportView {
    /// Boxes around the surfaces of the world that colour the light that passes them: smallest and largest corners.
    pub filters: u64,
    /// Boxes around what is translucent in sight of the eye, likewise.
    pub layers: u64,
    /// Number of `filters`.
    pub filter_count: u32,
    /// Number of `layers`; all ones: anything may be anywhere.
    pub layer_count: u32,
}

/// The flares of a view.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FlareView {
    /// [`Flare`](crate::types::Flare)s.
    pub flares: u64,
    /// [`FlareState`](crate::types::FlareState)s, by slot.
    pub states: u64,
}

/// Light in fog: bindless image indices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FogView {
    /// What light in fog is multiplied by to be seen, of each pixel.
    pub weight: u32,
    /// A point in the fog along the way of a pixel and its distance on the way, of each cell.
    pub point: u32,
    /// Light at such points, with the number of frames that it is the mean of.
    pub fresh: u32,
    /// The last frame's.
    pub last: u32,
    /// The light that is shown.
    pub filtered: u32,
    /// Pixels to the edge of a cell.
    pub cell: u32,
    /// Cells.
    pub width: u32,
    /// Cells.
    pub height: u32,
    /// `FOG_*` bits.
    pub flags: u32,
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
    /// R32UI: the albedo of what a pixel does not show where a reflection and what lies behind it are seen in turns.
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
    /// Camera of the last frame.
    pub last_eye: Vec3,
    pub last_forward: Vec3,
    pub last_left: Vec3,
    pub last_up: Vec3,
}

/// Names of constants used on both sides.
#[allow(missing_docs)] // see types.glsl
pub mod constants {
    pub const KIND_OPAQUE: u32 = 0;
    pub const KIND_TESTED: u32 = 1;
    pub const KIND_TRANSLUCENT: u32 = 2;
    pub const KIND_SKY: u32 = 3;
    pub const RAY_TILE: u32 = 16;
    pub const BVH_NONE: u32 = 0xFFFF_FFFF;
    pub const BVH_LEAF: u32 = 0x8000_0000;
    pub const BVH_COUNT_SHIFT: u32 = 28;
    pub const BVH_FIRST: u32 = 0x0FFF_FFFF;
    /// Entries that a walk of one level keeps for later at most.
    pub const BVH_STACK: u32 = 48;
    pub const MASK_SOLID: u8 = 0x01;
    pub const MASK_TRANSLUCENT: u8 = 0x02;
    pub const MASK_SKY: u8 = 0x04;
    pub const MASK_FIRST_SOLID: u8 = 0x08;
    pub const MASK_FIRST_TRANSLUCENT: u8 = 0x10;
    pub const MASK_THIRD_SOLID: u8 = 0x20;
    pub const MASK_THIRD_TRANSLUCENT: u8 = 0x40;
    pub const MASK_NO_SHADOW: u8 = 0x80;
    pub const LIGHT_TWO_SIDED: u32 = 1;
    pub const VIEW_JITTER: u32 = 1;
    pub const VIEW_FIRST_PERSON: u32 = 2;
    pub const VIEW_ACCUMULATE: u32 = 4;
    pub const VIEW_AUTO_EXPOSURE: u32 = 8;
    pub const VIEW_FAST_SKY: u32 = 16;
    pub const VIEW_EXPOSURE_RESET: u32 = 32;
    pub const VIEW_FULLBRIGHT: u32 = 64;
    pub const VIEW_HISTORY: u32 = 128;
    pub const VIEW_DENOISE: u32 = 256;
    /// Bounced light is gathered for one of each 2 × 2 pixels, which take turns.
    pub const VIEW_SPARSE_BOUNCE: u32 = 512;
    pub const DEBUG_ALBEDO: u32 = 1;
    pub const DEBUG_NORMALS: u32 = 2;
    pub const DEBUG_DEPTH: u32 = 3;
    pub const DEBUG_MOTION: u32 = 4;
    pub const DEBUG_CLUSTERS: u32 = 5;
    pub const DEBUG_LIGHTS: u32 = 6;
    pub const DEBUG_SAMPLES: u32 = 7;
    pub const DEBUG_VARIANCE: u32 = 8;
    pub const DEBUG_GRADIENTS: u32 = 9;
    pub const DEBUG_RAYS: u32 = 10;
    pub const DEBUG_SPECULAR: u32 = 11;
    pub const COUNT_EYE: u32 = 0;
    pub const COUNT_PRIMARY: u32 = 1;
    pub const COUNT_DIRECT: u32 = 2;
    pub const COUNT_INDIRECT: u32 = 3;
    pub const COUNT_BOUNCE: u32 = 4;
    pub const COUNT_BOUNCE_LIGHT: u32 = 5;
    pub const COUNT_SUNS: u32 = 6;
    pub const COUNTER_ROWS: u32 = 64;
    pub const NO_IMAGE: u32 = 0xFFFF_FFFF;
    pub const DENOISE_HISTORY: u32 = 1;
    pub const DENOISE_GRADIENTS: u32 = 2;
    pub const DENOISE_SPARSE: u32 = 4;
    pub const FOG_LIT: u32 = 1;
    pub const FOG_FILTERED: u32 = 2;
    pub const FOG_HISTORY: u32 = 4;
    pub const SELECT_UNIFORM: u32 = 0;
    pub const SELECT_RESAMPLED: u32 = 1;
    pub const WEAK_RAYS: u32 = 4;
    pub const SELECT_ALL: u32 = 2;
    pub const LIGHTS_SOFT: u32 = 1;
    pub const LIGHT_KIND_SHIFT: u32 = 29;
    pub const LIGHT_TRIANGLE: u32 = 0;
    pub const LIGHT_CHANGING_TRIANGLE: u32 = 1;
    pub const LIGHT_SPHERE: u32 = 2;
    pub const LIGHT_CHANGING_SPHERE: u32 = 3;
    pub const LIGHT_SUN: u32 = 4;
    pub const TRIANGLE_RANK_SHIFT: u32 = 8;
    pub const TRIANGLE_PATHS_SHIFT: u32 = 16;
    pub const PATHS_ALL: u32 = 0;
    pub const PATHS_DIRECT: u32 = 1;
    pub const PATHS_PORTAL: u32 = 2;
    pub const PATHS_MOST: u32 = 32;
    pub const LAST_UNKNOWN: u32 = 0;
    pub const LAST_MOVED: u32 = 1;
    pub const LAST_SAME: u32 = 2;
    pub const NO_INSTANCE: u32 = 0xFFFF_FFFF;
}
