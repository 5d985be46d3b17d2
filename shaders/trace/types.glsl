// The structures of the traced look that GLSL and Rust (shaders/src/trace_types) share, under the same names.
// Everything is laid out `scalar`. Addresses are buffer device addresses.
#ifndef RELIGHT_TRACE_TYPES_GLSL
#define RELIGHT_TRACE_TYPES_GLSL

#include "common/types.glsl"

struct GeometryRecord { uint64_t triangles; uint64_t vertices; uint instance; uint kind; };

struct TriangleLight { vec3 corners[3]; vec3 radiance; uint flags; float end; };

struct SphereLight { vec3 origin; float radius; vec3 radiance; float clearance; vec3 axis; float cos_inner; float cos_outer; float core; float reach; float end; };

struct SunLight { vec3 direction; float cos_angle; vec3 irradiance; };

struct LightBounds { vec3 centre; float radius; vec3 axis; float even; };

struct LightSlot {
    uint light; uint alias; float threshold; float chance; float alias_chance; float visibility; float alias_visibility; uint padding;
};

struct LightRow { uint first; uint count; uint strong; uint suns; uint cluster; };

struct DynamicRow { uint first; uint count; };

struct LightView {
    uint64_t bounds[4]; uint64_t triangles[2]; uint64_t spheres[2]; uint64_t suns; uint64_t rows; uint64_t slots;
    uint64_t dynamic_rows; uint64_t dynamic_lights; uint64_t nodes; uint64_t leaf_cells; uint64_t grid;
    uint node_count; uint row_count; uint dynamic_row_count; uint sun_count;
    uint flags; uint selection; uint samples; uint candidates;
    float scale; vec3 grid_origin; float grid_scale; uint grid_size[3];
};

struct BspNode { vec4 plane; int children[2]; };

struct BvhNode { vec3 origin; vec3 step; uint low[3]; uint high[3]; uint children[4]; };

struct BvhTriangle { vec3 a; vec3 b; vec3 c; uint primitive; uint part; uint padding; };

struct BvhInstance { uint64_t nodes; uint64_t triangles; vec4 to_object[3]; uint geometry; uint mask; };

struct SkyRecord { uint faces[6]; float cloud_height; };

struct PortalRecord {
    vec4 plane; uint mirror; vec3 surface_origin; vec3 surface_axis[3]; vec3 camera_origin; vec3 camera_axis[3];
};

struct LastInstance { vec3 axis[3]; vec3 origin; uint known; };

struct MotionView {
    uint64_t vertices; uint64_t vertex_bytes; uint64_t last_positions; uint64_t last_instances; uint64_t last_portals;
    uint path; uint last_path; uint still; uint time_stands;
};

struct PostView {
    uint64_t counters; uint64_t bloom; float bloom_strength; uint debug;
};

struct AntialiasView {
    vec2 jitter; uint output_width; uint output_height; uint image_picture; uint image_resolved; uint last_resolved;
    uint last_light; uint sampler_index; uint history; float lens_radius; float focal_distance; float texture_scale; float anisotropy; uint padding;
};

struct DenoiseView {
    uint64_t history; uint64_t fresh; uint64_t past; uint64_t last_past;
    uint flags; uint last_seed; uint samples; uint sample_surfaces; uint carried; uint stratum_guide; uint gradient_sums; uint gradient;
    uint slope; uint gradient_samples;
};

struct TransportView {
    uint64_t filters; uint64_t layers; uint64_t beyond; uint64_t beyond_surfaces;
    uint filter_count; uint layer_count; uint beyond_count; uint beyond_surface_count;
};

struct FlareView { uint64_t flares; uint64_t states; };

struct FogView {
    uint weight; uint point; uint fresh; uint last; uint filtered; uint cell; uint width; uint height;
    uint flags;
};

struct TraceView {
    uint64_t geometries; uint64_t instances; uint64_t fogs; uint64_t portals; uint64_t skies; uint64_t exposure; uint64_t texels;
    uint64_t bvh_nodes; uint64_t bvh_instances;
    MaterialBuffers materials;
    MotionView motion;
    PostView post;
    LightView lights;
    TransportView transport;
    FlareView flares;
    DenoiseView denoise;
    AntialiasView antialias;
    FogView fog;
    SunDisc sun;
    vec3 eye_absorption;
    vec3 eye; vec3 forward; vec3 left; vec3 up;
    uint width; uint height; int target_x; int target_y;
    uint scene; uint flags; uint seed; uint accumulated;
    float time; float pixel_spread; vec3 ambient;
    float eye_shift; uint channels;
    uint fog_count; uint portal_count; uint flare_count;
    uint max_depth; uint bounces;
    uint image_position; uint image_surface; uint image_shown; uint image_other; uint image_direct; uint image_indirect; uint image_composite;
    uint image_accumulation; uint image_motion; uint image_rays; uint image_target;
    float exposure_bias; float exposure_base; float exposure_middle; float exposure_blend; float exposure_blend_dark;
    uint target_width; uint target_height; uint sky_sampler; float sky_distance;
    vec3 last_eye; vec3 last_forward; vec3 last_left; vec3 last_up;
    uint padding;
};

// What a geometry's triangles are to a ray.
const uint KIND_OPAQUE = 0, KIND_TESTED = 1, KIND_TRANSLUCENT = 2, KIND_SKY = 3, KIND_PASSED = 4;
// Edge of the tiles of pixels whose rays are sorted.
const uint RAY_TILE = 16;
// BvhNode.children: nothing; the bit of a leaf; where the number of its entries less one stands; the first of them.
const uint BVH_NONE = 0xFFFFFFFFu, BVH_LEAF = 0x80000000u, BVH_COUNT_SHIFT = 28, BVH_FIRST = 0x0FFFFFFFu;
// Entries that a walk of one level keeps for later at most.
const uint BVH_STACK = 48;
// Masks of top-level instances.
const uint MASK_SOLID = 0x01, MASK_TRANSLUCENT = 0x02, MASK_SKY = 0x04, MASK_FIRST_SOLID = 0x08, MASK_FIRST_TRANSLUCENT = 0x10,
    MASK_THIRD_SOLID = 0x20, MASK_THIRD_TRANSLUCENT = 0x40, MASK_NO_SHADOW = 0x80;
// Bits of TriangleLight.flags.
const uint LIGHT_TWO_SIDED = 1;
// Bits of TraceView.flags.
const uint VIEW_JITTER = 1, VIEW_FIRST_PERSON = 2, VIEW_ACCUMULATE = 4, VIEW_AUTO_EXPOSURE = 8, VIEW_FAST_SKY = 16,
    VIEW_EXPOSURE_RESET = 32, VIEW_FULLBRIGHT = 64, VIEW_HISTORY = 128, VIEW_DENOISE = 256,
    VIEW_SPARSE_BOUNCE = 512;
// The views of rt_debug.
const uint DEBUG_ALBEDO = 1, DEBUG_NORMALS = 2, DEBUG_DEPTH = 3, DEBUG_MOTION = 4, DEBUG_CLUSTERS = 5, DEBUG_LIGHTS = 6,
    DEBUG_SAMPLES = 7, DEBUG_VARIANCE = 8, DEBUG_GRADIENTS = 9, DEBUG_RAYS = 10, DEBUG_SPECULAR = 11;
// Counted passes, and counters of each.
const uint COUNT_EYE = 0, COUNT_PRIMARY = 1, COUNT_DIRECT = 2, COUNT_INDIRECT = 3, COUNT_BOUNCE = 4, COUNT_BOUNCE_LIGHT = 5, COUNT_SUNS = 6, COUNTER_ROWS = 64;
// No storage image.
const uint NO_IMAGE = 0xFFFFFFFFu;
// Bits of DenoiseView.flags: the last frame's light is there; its samples are lit again; the cheap
// filter.
const uint DENOISE_HISTORY = 1, DENOISE_GRADIENTS = 2, DENOISE_SPARSE = 4;
// Bits of FogView.flags: fog is lit; its light is filtered; the last frame's is there.
const uint FOG_LIT = 1, FOG_FILTERED = 2, FOG_HISTORY = 4;
// How a light is chosen: LightView.selection.
const uint SELECT_UNIFORM = 0, SELECT_RESAMPLED = 1, SELECT_ALL = 2;
// Bits of LightView.flags.
// rays of an estimate by all lights for the weak ones of a list
const uint WEAK_RAYS = 3;
const uint LIGHTS_SOFT = 1;
// The upper bits of a light's number say what it is, the others which one.
const uint FACINGS = 6;
const uint LIGHT_KIND_SHIFT = 29;
const uint LIGHT_TRIANGLE = 0, LIGHT_CHANGING_TRIANGLE = 1, LIGHT_SPHERE = 2, LIGHT_CHANGING_SPHERE = 3, LIGHT_SUN = 4;
// Triangle.flags: bits from here on hold the drawing rank, sort value times 8, at most 255.
const uint TRIANGLE_RANK_SHIFT = 8;
// Highest rank of an opaque material: sort 3 (SS_OPAQUE) times 8.
const uint RANK_OPAQUE = 24;
// The eight bits from here on say which paths of the eye meet it: all; those that have passed no portal; from PATHS_PORTAL
// on those through one portal each, then, where the numbers up to PATHS_MOST do, those through two.
const uint TRIANGLE_PATHS_SHIFT = 16;
const uint PATHS_ALL = 0, PATHS_DIRECT = 1, PATHS_PORTAL = 2, PATHS_MOST = 32;
// LastInstance.known: never seen before, placed elsewhere, placed as now.
const uint LAST_UNKNOWN = 0, LAST_MOVED = 1, LAST_SAME = 2;
// No instance of its own: the triangle names it.
const uint NO_INSTANCE = 0xFFFFFFFFu;

#endif
