// Test of the gpu layer: one ray straight down through each pixel of a square, by pipeline or by query.
#ifndef TEST_RAYS_GLSL
#define TEST_RAYS_GLSL
#define BINDLESS_SCENES
#include "common/bindless.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Hits { uvec4 at[]; };
layout(push_constant, scalar) uniform Push { Hits hits; uint scene; uint size; };

vec3 origin_of(uvec2 pixel) { return vec3((vec2(pixel) + 0.5) / float(size), 1.0); }
// The any-hit rule: the left half of the triangles' own coordinates is a hole.
bool hole(vec2 barycentrics) { return barycentrics.x < 0.25; }

#endif
