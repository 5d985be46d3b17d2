// What the vertex and fragment shader of the classic look share: the push constants and the interface between them.
#extension GL_EXT_buffer_reference2 : require
#include "common/bindless.glsl"
#include "common/material.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Vertices { Vertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Instances { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Draws { Draw at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Fogs { Fog at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RasterLights { RasterLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Views { RasterView view; };

// Flat from the vertex to the fragment shader, so that the latter reads no memory but textures: x, y: textures of the
// stages or NO_TEXTURE (white); z: samplers in bits 0-7 and 8-15, alpha test in 16-19, COMBINE_* in 20; w: DRAW_*.

layout(push_constant, scalar) uniform Push { uint64_t view; } push;

// The engine keeps this in a 256x32 texture; s: distance in the fog, t: how deep.
float fog_factor(vec2 c) {
    float s = c.x - 1.0 / 512.0;
    if (s < 0.0 || c.y < 1.0 / 32.0) return 0.0;
    if (c.y < 31.0 / 32.0) s *= (c.y - 1.0 / 32.0) / (30.0 / 32.0);
    return sqrt(min(s * 8.0, 1.0));
}
