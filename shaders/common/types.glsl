// The structures and constants that GLSL and Rust (shaders/src/types.rs) share, under the same names.
// Everything is laid out `scalar`. A test compares the member offsets of both sides.
#ifndef RELIGHT_TYPES_GLSL
#define RELIGHT_TYPES_GLSL

#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_scalar_block_layout : require

struct Vertex { vec3 position; vec3 normal; vec2 st; vec2 lightmap; uint color; };

struct Wave { uint function; float base; float amplitude; float phase; float frequency; };

struct TcMod { uint kind; float values[6]; Wave wave; };

struct Stage {
    uint image_first; uint image_count; float image_frequency; uint sampler_index;
    uint tc_gen; vec3 vector_s; vec3 vector_t; uint tc_mod_first; uint tc_mod_count;
    uint rgb_gen; uint alpha_gen; vec4 constant; Wave rgb_wave; Wave alpha_wave;
    float portal_range; uint alpha_func; uint blend_src; uint blend_dst; uint flags;
};

struct Dielectric { float index; float ripple; float scale; uint filters; vec3 filter_color; vec3 absorption; };

struct Material {
    uint stage_first; uint stage_count; uint flags; float time_offset; float clamp_time;
    uint plain_image; uint plain_sampler; vec3 light_radiance; float lit_scale; Dielectric dielectric;
};

struct Instance {
    vec3 axis[3]; vec3 origin; vec3 viewer; vec4 color; vec2 texcoord; float time;
    vec3 ambient; vec3 directed; vec3 light_direction; float added; uint flags;
};

struct Triangle { uint indices[3]; uint material; uint instance; uint fog; uint lightmap; uint flags; };

struct Fog { vec3 mins; vec3 maxs; vec4 plane; uint has_surface; vec3 color; float depth; vec3 own_light; };

struct MaterialBuffers { uint64_t materials; uint64_t stages; uint64_t tc_mods; uint64_t images; uint64_t noise; };

struct RasterView {
    vec4 world_to_clip[4]; vec4 clip_plane; vec3 eye; vec3 forward; float identity_light; uint light_backs; MaterialBuffers materials;
    uint64_t static_vertices; uint64_t dynamic_vertices; uint64_t instances; uint64_t draws; uint64_t fogs; uint64_t lights;
};

struct Draw {
    uint textures[4]; uint stages[4]; float texcoords[4][6]; vec4 colors[4]; float time; uint instance; uint fog; uint light;
    uint dynamic_vertices;
};

struct Flare { vec3 color; float size; vec2 center; uint pixel[2]; float depth; uint slot; uint fresh; vec3 at; float reach; };

struct SunDisc { vec3 direction; uint material; vec3 left; float size; };

struct FlareState { uint seen; uint visible; int since; };

struct RasterLight { vec3 origin; float radius; vec3 color; };

const uint NO_TEXTURE = 0xFFFFFFFFu;
const uint WAVE_SIN = 0, WAVE_SQUARE = 1, WAVE_TRIANGLE = 2, WAVE_SAWTOOTH = 3, WAVE_INVERSE_SAWTOOTH = 4, WAVE_NOISE = 5;
const uint TCMOD_TURBULENT = 0, TCMOD_SCALE = 1, TCMOD_SCROLL = 2, TCMOD_STRETCH = 3, TCMOD_TRANSFORM = 4, TCMOD_ROTATE = 5,
    TCMOD_ENTITY_TRANSLATE = 6;
const uint TCGEN_BASE = 0, TCGEN_LIGHTMAP = 1, TCGEN_ENVIRONMENT = 2, TCGEN_VECTOR = 3;
const uint RGBGEN_IDENTITY = 0, RGBGEN_IDENTITY_LIGHTING = 1, RGBGEN_WAVE = 2, RGBGEN_CONST = 3, RGBGEN_ENTITY = 4,
    RGBGEN_ONE_MINUS_ENTITY = 5, RGBGEN_VERTEX = 6, RGBGEN_EXACT_VERTEX = 7, RGBGEN_ONE_MINUS_VERTEX = 8, RGBGEN_LIGHTING_DIFFUSE = 9;
const uint ALPHAGEN_IDENTITY = 0, ALPHAGEN_CONST = 1, ALPHAGEN_WAVE = 2, ALPHAGEN_ENTITY = 3, ALPHAGEN_ONE_MINUS_ENTITY = 4,
    ALPHAGEN_VERTEX = 5, ALPHAGEN_ONE_MINUS_VERTEX = 6, ALPHAGEN_LIGHTING_SPECULAR = 7, ALPHAGEN_PORTAL = 8;
const uint ALPHAFUNC_NONE = 0, ALPHAFUNC_GT0 = 1, ALPHAFUNC_LT128 = 2, ALPHAFUNC_GE128 = 3;
const uint BLEND_ZERO = 0, BLEND_ONE = 1, BLEND_DST_COLOR = 2, BLEND_ONE_MINUS_DST_COLOR = 3, BLEND_SRC_ALPHA = 4,
    BLEND_ONE_MINUS_SRC_ALPHA = 5, BLEND_DST_ALPHA = 6, BLEND_ONE_MINUS_DST_ALPHA = 7, BLEND_SRC_ALPHA_SATURATE = 8,
    BLEND_SRC_COLOR = 9, BLEND_ONE_MINUS_SRC_COLOR = 10;
const uint STAGE_WHITE = 1, STAGE_DEPTH_WRITE = 2, STAGE_DEPTH_EQUAL = 4, STAGE_REFLECTION = 8, STAGE_MATTER = 16, STAGE_GLOSS = 32, STAGE_NO_LIGHTMAP = 64,
    STAGE_HAZE = 128, STAGE_BAKED_LIGHT = 256, STAGE_LIGHT_STYLE = 512;
const uint MATERIAL_TWO_SIDED = 1, MATERIAL_CULL_BACK = 2, MATERIAL_CUT_OUT = 4, MATERIAL_TRANSLUCENT = 8, MATERIAL_SKY = 16,
    MATERIAL_PORTAL = 32, MATERIAL_FOG = 64, MATERIAL_LIQUID = 128, MATERIAL_GLASS = 256, MATERIAL_VERTEX_LIGHT = 512,
    MATERIAL_POLYGON_OFFSET = 1024, MATERIAL_EMITTER = 2048, MATERIAL_INVISIBLE = 4096, MATERIAL_PASSED = 8192;
const uint INSTANCE_DEPTH_HACK = 1, INSTANCE_FIRST_PERSON = 2, INSTANCE_THIRD_PERSON = 4, INSTANCE_NO_SHADOW = 8, INSTANCE_UNLIT = 16,
    INSTANCE_CROSSHAIR = 32, INSTANCE_SUSPENDED = 64;
const uint DRAW_STAGE = 0, DRAW_LIGHT = 1, DRAW_FOG = 2, DRAW_DEPTH = 3;
const uint COMBINE_NONE = 0, COMBINE_MODULATE = 1, COMBINE_ADD = 2, COMBINE_REPLACE = 3, COMBINE_BLEND = 4;
const uint DRAW_STAGES = 4;
const uint COLOR_WHITE = 0, COLOR_FLAT = 1, COLOR_VERTEX = 2;
const uint FOG_ADJUST_NONE = 0, FOG_ADJUST_RGB = 1, FOG_ADJUST_ALPHA = 2, FOG_ADJUST_RGBA = 3;
const uint FOG_SURFACE_NONE = 0, FOG_SURFACE = 1, FOG_SURFACE_DRAWN = 2;
const uint TRIANGLE_WORLD = 1, TRIANGLE_FACES_EYE = 2, TRIANGLE_ONE_SIDED = 4, TRIANGLE_STATIC = 8;

#endif
