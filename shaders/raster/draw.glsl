// Shared by the vertex and fragment shader of the classic look: specialization constants (`raster/shading.rs`), push
// constants and the interface between both stages.
#extension GL_EXT_buffer_reference2 : require
#include "common/bindless.glsl"
#include "common/fog.glsl"
#include "common/material.glsl"
#include "common/tangent_space.glsl"

layout(constant_id = 0) const uint MODE = 0;          // DRAW_*
layout(constant_id = 1) const uint FOG_ADJUST = 0;    // FOG_ADJUST_* of the first stage
layout(constant_id = 2) const uint CLIP = 0;          // 1: there is a clip plane
layout(constant_id = 3) const uint TEXTURES = 0xF;    // bit i: stage i has a texture; a stage without one is white
layout(constant_id = 4) const uint TC_MODS = 0;       // bit i: the `tcMod`s of stage i differ between vertices
// Four bits per stage, stage 0 in the lowest; read by `of_stage`.
layout(constant_id = 5) const uint COMBINE = 0;       // COMBINE_*
layout(constant_id = 6) const uint BLEND_SOURCE = 0;  // BLEND_* of COMBINE_BLEND
layout(constant_id = 7) const uint BLEND_TARGET = 0;  // BLEND_* of COMBINE_BLEND
layout(constant_id = 8) const uint ALPHA_FUNC = 0;    // ALPHAFUNC_*, of the last stage of each pass
layout(constant_id = 9) const uint COLOR = 2;         // COLOR_*
layout(constant_id = 10) const uint RGB_GEN = 0;      // RGBGEN_* of COLOR_VERTEX
layout(constant_id = 11) const uint ALPHA_GEN = 0;    // ALPHAGEN_* of COLOR_VERTEX
layout(constant_id = 12) const uint TC_GEN = 0;       // TCGEN_*
layout(constant_id = 13) const uint MAPPING = 0;       // MAPPING_*; see `surface_mapping.glsl`

// Of a draw with normal or specular mapping: the stage with the texture, and that with its light, plus one (0: the colour of the first).
const uint TEXTURE_STAGE = MAPPING >> MAPPING_TEXTURE_SHIFT & 0xF;
const uint LIGHT_STAGE = MAPPING >> MAPPING_LIGHT_SHIFT & 0xF;

// Most draws have one stage. Drivers create pipelines several times faster without the code of the other stages.
#ifdef MANY_STAGES
const uint STAGES = DRAW_STAGES;
#else
const uint STAGES = 1;
#endif
const uint STAGE_PAIRS = (STAGES + 1) / 2;

uint of_stage(uint constant, uint stage) { return constant >> 4 * stage & 0xF; }

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vertices { Vertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Instances { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Draws { Draw at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Fogs { Fog at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RasterLights { RasterLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Views { RasterView view; };

// `overdraw`: address of the fragment counter; 0: fragments are not counted.
#ifdef HYBRID
// `hybrid`: address of the `HybridView`.
layout(push_constant, scalar) uniform Push { uint64_t view; uint64_t hybrid; } push;
#else
layout(push_constant, scalar) uniform Push { uint64_t view; uint64_t overdraw; } push;
#endif

// Shaders read single members where they need them: drivers are slow to reduce a copy of the whole structure to the
// members that are used.
#define VIEW Views(push.view).view

// Fog factor, 0..1. s: distance in the fog, t: depth below its surface. The engine reads the root from a table of 256
// values. Fog over opaque surfaces samples an image of this function instead (`fog_picture` in `assets/prepare.rs`).
float fog_factor(vec2 c) {
    float s = c.x - 1.0 / 512.0;
    if (s < 0.0 || c.y < 1.0 / 32.0) return 0.0;
    if (c.y < 31.0 / 32.0) s *= (c.y - 1.0 / 32.0) / (30.0 / 32.0);
    return sqrt(floor(min(s * 8.0, 1.0) * 255.0) / 255.0);
}
