//! Constants of the traced look that Rust and GLSL share. The build script writes them as
//! `generated/trace_types.glsl`.
#![allow(missing_docs)] // the comment of a group's first constant describes the group

/// Kind of a geometry's triangles.
pub const KIND_OPAQUE: u32 = 0;
pub const KIND_TESTED: u32 = 1;
pub const KIND_TRANSLUCENT: u32 = 2;
pub const KIND_SKY: u32 = 3;
pub const KIND_PASSED: u32 = 4;

/// `TransportView::mirror_of_surface`: the surface is no flat mirror, or is in no list.
pub const NO_MIRROR: u32 = 0xFFFF_FFFF;

/// Mirrors that have a bit in the masks of clusters: the largest ones.
pub const MASKED_MIRRORS: u32 = 32;

/// Bits of `MirrorPlane::flags`: some of its mirrors reflect on both sides.
pub const MIRROR_TWO_SIDED: u32 = 1;
/// They are glass or surfaces of liquids.
pub const MIRROR_TRANSLUCENT: u32 = 2;

/// How rays of scattered light meet cut-outs (`rt_cutouts`): by their alpha test; as solid; as solid, but a ray may skip a
/// whole one; by a mask that needs no image.
pub const CUT_OUTS_TESTED: u32 = 0;
pub const CUT_OUTS_SOLID: u32 = 1;
pub const CUT_OUTS_SKIPPED: u32 = 2;
pub const CUT_OUTS_MASKED: u32 = 3;

/// Photons in a row of their launch.
pub const PHOTON_ROW: u32 = 512;

/// Words in a row of the launch that moves records of instances.
pub const LIST_ROW: u32 = 262144;

/// Bit of `LightGrid::segments`: the other side has vertices of its own behind those of the first.
pub const GRID_TWO_SIDED: u32 = 0x10000;
/// Mask of the number of segments.
pub const GRID_SEGMENTS: u32 = 0xFFFF;
/// Most segments of an edge.
pub const GRID_MOST: u32 = 128;
/// Vertices, and triangles, in a row of a launch.
pub const VERTEX_ROW: u32 = 1024;

/// Bits of `VertexSum::cells`: no wall crosses the cell towards the opposite edge; that behind it.
pub const CELL_UP: u32 = 1;
pub const CELL_DOWN: u32 = 2;

/// Bits of `PassStep::part` of the passes of vertices: direct light alone, with the random numbers of the triangle; bounced
/// light replaces that of the last sweep; a quarter of the samples; the edges of cells are tested by rays.
pub const VERTICES_DIRECT: u32 = 1;
pub const VERTICES_RESTART: u32 = 2;
pub const VERTICES_QUICK: u32 = 4;
pub const VERTICES_TEST: u32 = 8;

/// Levels of bloom, each of half the size of the one before.
pub const BLOOM_LEVELS: u32 = 5;

/// Pixels to a texel of the first level of bloom, along each axis.
pub const BLOOM_FIRST: u32 = 4;

/// Edge of the tiles of pixels whose rays are sorted, pixels.
pub const RAY_TILE: u32 = 16;

/// `BvhNode::children`: no child.
pub const BVH_NONE: u32 = 0xFFFF_FFFF;

/// `BvhNode::children`: bit that marks a leaf.
pub const BVH_LEAF: u32 = 0x8000_0000;

/// `BvhNode::children` of a leaf: lowest bit of the number of its entries minus one.
pub const BVH_COUNT_SHIFT: u32 = 28;

/// `BvhNode::children` of a leaf: mask of the index of its first entry.
pub const BVH_FIRST: u32 = 0x0FFF_FFFF;

/// Size of the traversal stack of one level, entries.
pub const BVH_STACK: u32 = 48;

/// Bit of `BvhInstance::mask` above those of the masks of rays: the instance has a grid.
pub const INSTANCE_GRID: u32 = 0x100;

/// Masks of top-level instances.
pub const MASK_SOLID: u8 = 0x01;
pub const MASK_TRANSLUCENT: u8 = 0x02;
pub const MASK_SKY: u8 = 0x04;
pub const MASK_FIRST_SOLID: u8 = 0x08;
pub const MASK_FIRST_TRANSLUCENT: u8 = 0x10;
pub const MASK_THIRD_SOLID: u8 = 0x20;
pub const MASK_THIRD_TRANSLUCENT: u8 = 0x40;
pub const MASK_NO_SHADOW: u8 = 0x80;

/// Rays to models from a texel of the hybrid look.
pub const HYBRID_RAYS: u32 = 2;
/// Length of these rays, units: a player at the end of one occludes less than 2 % of the floor's hemisphere.
pub const HYBRID_REACH: u32 = 128;
/// Models within this distance of a dynamic light do not hide it, units: half the height of a player.
pub const HYBRID_CLEARANCE: u32 = 32;
/// A dynamic light that lies deeper behind a surface does not light it, units.
pub const HYBRID_SINK: u32 = 4;

/// Bits of `TriangleLight::flags`.
pub const LIGHT_TWO_SIDED: u32 = 1;
/// A triangle of the map that rays of bounces can hit, with constant radiance.
pub const LIGHT_HITTABLE: u32 = 2;

/// Bits of `TraceView::flags`.
pub const VIEW_JITTER: u32 = 1;
pub const VIEW_FIRST_PERSON: u32 = 2;
pub const VIEW_ACCUMULATE: u32 = 4;
pub const VIEW_AUTO_EXPOSURE: u32 = 8;
pub const VIEW_FAST_SKY: u32 = 16;
pub const VIEW_EXPOSURE_RESET: u32 = 32;
pub const VIEW_FULLBRIGHT: u32 = 64;
pub const VIEW_HISTORY: u32 = 128;
pub const VIEW_DENOISE: u32 = 256;
/// One of each 2 × 2 pixels gathers bounced light, alternating over frames.
pub const VIEW_SUBSAMPLED_BOUNCE: u32 = 512;
/// Rays of sight meet heights by halved steps (`r_parallaxMapping 2`).
pub const VIEW_RELIEF: u32 = 1024;

/// Of this many invocations one counts the boxes on its rays, for `rt_hitFeedback`.
pub const FEEDBACK_RAYS: u32 = 16;
/// A counter with so many rays is not raised further: more change nothing, and writes to one address wait for each other.
pub const FEEDBACK_MOST: u32 = 1024;

/// The views of `rt_debug`: `PostView::debug`.
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
pub const DEBUG_TIME: u32 = 12;
pub const DEBUG_RAY_TIME: u32 = 13;

/// Frames that a view of time averages: a frame has the weight 1 / `TIMED_FRAMES`.
pub const TIMED_FRAMES: u32 = 10;

/// Width and height of the square of blue noise, texels.
pub const BLUE_NOISE_SIZE: u32 = 64;

/// Bins of the histogram of luminance.
pub const EXPOSURE_BINS: u32 = 128;

/// Counted passes.
pub const COUNT_PRIMARY_RAYS: u32 = 0;
pub const COUNT_PRIMARY: u32 = 1;
pub const COUNT_DIRECT: u32 = 2;
pub const COUNT_BOUNCE_RAYS: u32 = 3;
pub const COUNT_BOUNCE_LIGHT: u32 = 4;
pub const COUNT_SUNS: u32 = 5;
pub const COUNT_MIRRORS: u32 = 6;
pub const COUNT_SPECULAR: u32 = 7;
pub const COUNT_PHOTONS: u32 = 8;
pub const COUNT_MORE_SAMPLES: u32 = 9;

/// Counters of each counted pass, to reduce contention.
pub const COUNTER_ROWS: u32 = 64;

/// No storage image.
pub const NO_IMAGE: u32 = 0xFFFF_FFFF;

/// Bits of `DenoiseView::flags`: the history is valid; gradient samples are shaded; the sparse filter is used.
pub const DENOISE_HISTORY: u32 = 1;
pub const DENOISE_GRADIENTS: u32 = 2;
pub const DENOISE_SPARSE: u32 = 4;

/// Bits of `FogView::flags`: fog is lit; its light is filtered; its light of the last frame is valid.
pub const FOG_LIT: u32 = 1;
pub const FOG_FILTERED: u32 = 2;
pub const FOG_HISTORY: u32 = 4;

/// Estimators of light sampling: `LightView::selection`.
pub const SELECT_UNIFORM: u32 = 0;
pub const SELECT_RESAMPLED: u32 = 1;
pub const SELECT_ALL: u32 = 2;

/// Bits of `ReservoirView::flags`: the samples of the last frame are valid.
pub const RESERVOIRS_HISTORY: u32 = 1;

/// `SELECT_ALL`: a light whose part of a point's estimated light is the inverse of this or more has a ray of its own.
pub const ALL_RAYS: u32 = 64;
/// `SELECT_ALL`: rays to lights that a cell's row does not state.
pub const PARENT_RAYS: u32 = 2;

/// [`LightRow`](super::LightRow): suns can reach the cell.
pub const LIGHT_ROW_SUNS: u32 = 1;
/// The visibility of the row's lights is known from rays.
pub const LIGHT_ROW_SWEPT: u32 = 2;

/// A row without a parent.
pub const NO_PARENT: u32 = 0xFFFF_FFFF;

/// Of this many draws from a row with a parent, one is from the parent.
pub const PARENT_DRAWS: u32 = 8;

/// Bits of `LightView::flags`.
pub const LIGHTS_SOFT: u32 = 1;

/// Light lists of each cell, one for each normal bin: the signed axis that a normal is nearest to.
pub const NORMAL_BINS: u32 = 6;

/// Lowest bit of the kind in a light's number; the bits below are its index within the kind.
pub const LIGHT_KIND_SHIFT: u32 = 29;

/// Kinds of lights.
pub const LIGHT_TRIANGLE: u32 = 0;
pub const LIGHT_CHANGING_TRIANGLE: u32 = 1;
pub const LIGHT_SPHERE: u32 = 2;
pub const LIGHT_CHANGING_SPHERE: u32 = 3;
pub const LIGHT_SUN: u32 = 4;

/// `Triangle::flags`: lowest bit of the drawing rank, sort value times 8, at most 255.
pub const TRIANGLE_RANK_SHIFT: u32 = 8;

/// Highest rank of an opaque material: sort 3 (`SS_OPAQUE`) times 8.
pub const RANK_OPAQUE: u32 = 24;

/// `Triangle::flags`: lowest of eight bits that hold the primary paths (`PATHS_*`) that hit the triangle.
pub const TRIANGLE_PATHS_SHIFT: u32 = 16;

/// Paths by the portals that they have passed: all paths; those through no portal; from `PATHS_PORTAL` on, those
/// through one portal each, then, if the numbers up to `PATHS_MOST` suffice, those through two.
pub const PATHS_ALL: u32 = 0;
pub const PATHS_DIRECT: u32 = 1;
pub const PATHS_PORTAL: u32 = 2;
pub const PATHS_MOST: u32 = 32;

/// `LastInstance::known`: not in the last frame; moved since; at the same place.
pub const LAST_UNKNOWN: u32 = 0;
pub const LAST_MOVED: u32 = 1;
pub const LAST_SAME: u32 = 2;

/// Streams of a pixel's random numbers (`rng_begin` in `random.glsl`): primary paths.
pub const STREAM_PRIMARY: u32 = 0;
/// Light sampling of the visible surface.
pub const STREAM_LIGHT: u32 = 1;
/// Bounced light.
pub const STREAM_BOUNCE: u32 = 2;
/// Light in fog, per cell instead of per pixel.
pub const STREAM_FOG: u32 = 3;
/// The sampled point on a sun, equal in all passes that sample it.
pub const STREAM_SUN: u32 = 4;
/// Other random numbers of the pass of suns.
pub const STREAM_SUN_PASS: u32 = 5;
/// Number of streams: distance between those of the passes of bounces.
pub const STREAMS: u32 = 6;
/// Light across mirrors of the first bounce: after the streams of three passes of 16 bounces.
pub const STREAM_MIRRORS: u32 = 290;
/// Distance between the streams of one path of a pixel and those of the next.
pub const STREAM_PATH: u32 = 4096;
/// The sampled light of a rough surface: before the streams of the next path.
pub const STREAM_SPECULAR: u32 = 4000;
/// Photons, by number instead of by pixel.
pub const STREAM_PHOTONS: u32 = 4001;
/// Reuse of the light samples of neighbours.
pub const STREAM_REUSE: u32 = 4002;

/// Light at vertices, by vertex or triangle instead of by pixel.
pub const STREAM_VERTICES: u32 = 4003;
/// Light of a bake, by point and light instead of by pixel.
pub const STREAM_BAKE: u32 = 4004;

/// `BakeTriangle::kind`: the triangle reflects nothing; its light is at texels, or at its corners.
pub const BAKE_DARK: u32 = 0;
pub const BAKE_TEXELS: u32 = 1;
pub const BAKE_VERTICES: u32 = 2;

/// `PassStep::part` of a bounce: bit of the paths that start at rough surfaces; number of the first bit of the path's
/// number; below it the pixel of the cell.
pub const PART_SPECULAR: u32 = 0x8000_0000;
pub const PART_PATH_SHIFT: u32 = 2;
/// Number of the first path that starts at a rough surface: above those of `rt_samples`.
pub const SPECULAR_PATHS: u32 = 8;

/// Estimators of specular light (`TransportView::specular_estimator`): rays by the surface's distribution and samples of
/// lights, weighted; only one of them, for tests.
pub const SPECULAR_BOTH: u32 = 0;
pub const SPECULAR_LIGHTS: u32 = 1;
pub const SPECULAR_RAYS: u32 = 2;

/// Edge of the table of specular albedo, entries.
pub const SPECULAR_TABLE: u32 = 32;

/// Streams of the denoiser's random numbers (`dither` in `denoise.glsl`): rounding of the fresh light; with
/// `rt_denoiser 2` of the number of frames.
pub const DITHER_FRESH: u32 = 0;
/// Rounding of the number of frames and the variance; with `rt_denoiser 2` of the light.
pub const DITHER_PAST: u32 = 1;
/// Rounding of filtered light.
pub const DITHER_FILTERED: u32 = 2;
/// Selection of a stratum's pixel as the next frame's gradient sample.
pub const DITHER_SAMPLE: u32 = 3;
/// Rotation of the taps with `rt_denoiser 2`: this plus the spacing of the taps in pixels.
pub const DITHER_ROTATION: u32 = 4;
/// Rounding of interpolated bounced light.
pub const DITHER_UPSAMPLED: u32 = 5;
/// Column and row of the first candidate for the gradient sample.
pub const DITHER_SAMPLE_COLUMN: u32 = 6;
pub const DITHER_SAMPLE_ROW: u32 = 7;
/// Rounding of specular light, and rotation of its taps.
pub const DITHER_SPECULAR: u32 = 8;
pub const DITHER_SPECULAR_TURN: u32 = 9;
/// Rounding of the light that the next frame's bounces take.
pub const DITHER_SCREEN: u32 = 10;

/// Lights of the pass of direct light (`SAMPLING` in `direct.rgen`): lights that it samples itself; lights that
/// `sample_lights.comp` has sampled; suns.
pub const SAMPLING_HERE: u32 = 0;
pub const SAMPLING_LIGHT: u32 = 1;
pub const SAMPLING_SUNS: u32 = 2;

/// `GeometryRecord::instance`: each triangle names its own instance.
pub const NO_INSTANCE: u32 = 0xFFFF_FFFF;
