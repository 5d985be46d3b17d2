// What the vertex and fragment shader of the classic look share: the specialization constants (raster/shading.rs), the
// push constants and the interface between them.
#extension GL_EXT_buffer_reference2 : require
#include "common/bindless.glsl"
#include "common/fog.glsl"
#include "common/material.glsl"

layout(constant_id = 0) const uint MODE = 0;          // DRAW_*
layout(constant_id = 1) const uint FOG_ADJUST = 0;    // FOG_ADJUST_* of the first stage
layout(constant_id = 2) const uint CLIP = 0;          // 1: there is a clip plane
layout(constant_id = 3) const uint TEXTURES = 0xF;    // bit i: stage i has a texture; otherwise it is white
layout(constant_id = 4) const uint TC_MODS = 0;       // bit i: stage i's tcMods differ between vertices
// Four bits for each stage, the first's lowest: `of_stage`.
layout(constant_id = 5) const uint COMBINE = 0;       // COMBINE_*
layout(constant_id = 6) const uint BLEND_SOURCE = 0;  // BLEND_* of COMBINE_BLEND
layout(constant_id = 7) const uint BLEND_TARGET = 0;  // BLEND_* of COMBINE_BLEND
layout(constant_id = 8) const uint ALPHA_FUNC = 0;    // ALPHAFUNC_*, of the last stage of each pass
layout(constant_id = 9) const uint COLOR = 2;         // COLOR_*
layout(constant_id = 10) const uint RGB_GEN = 0;      // RGBGEN_* of COLOR_VERTEX
layout(constant_id = 11) const uint ALPHA_GEN = 0;    // ALPHAGEN_* of COLOR_VERTEX
layout(constant_id = 12) const uint TC_GEN = 0;       // TCGEN_*

// Most draws have one stage, and a driver makes pipelines several times faster of shaders without the others.
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

// `overdraw`: where fragments are counted, if they are.
layout(push_constant, scalar) uniform Push { uint64_t view; uint64_t overdraw; } push;

// Members are read one by one where they are needed: a driver takes long to find out that a copy of all is for a few.
#define VIEW Views(push.view).view

// How much of what is seen is fog; s: distance in the fog, t: how deep. The engine takes the root from a table of 256
// values. Fog over opaque surfaces is a picture of this instead (`fog_picture` in assets/prepare.rs).
float fog_factor(vec2 c) {
    float s = c.x - 1.0 / 512.0;
    if (s < 0.0 || c.y < 1.0 / 32.0) return 0.0;
    if (c.y < 31.0 / 32.0) s *= (c.y - 1.0 / 32.0) / (30.0 / 32.0);
    return sqrt(floor(min(s * 8.0, 1.0) * 255.0) / 255.0);
}
