#version 460
// One point for each flare, at the pixel and depth of its test.
#include "raster/flares.glsl"

layout(push_constant, scalar) uniform Push { uint64_t flares; uint64_t states; vec2 size; } push;
layout(location = 0) out flat uint out_slot;

void main() {
    Flare flare = Flares(push.flares).at[gl_VertexIndex];
    vec2 pixel = vec2(flare.pixel[0], flare.pixel[1]) + 0.5;
    gl_Position = vec4(pixel / push.size * 2.0 - 1.0, flare.depth, 1.0);
    gl_PointSize = 1.0;
    out_slot = flare.slot;
}
