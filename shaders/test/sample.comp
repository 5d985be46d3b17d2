#version 460
// Test of the gpu layer: samples a texture by its index and a sampler's, one texel per invocation.
#include "common/bindless.glsl"

layout(local_size_x = 64) in;
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Colors { vec4 at[]; };
layout(push_constant, scalar) uniform Push { Colors colors; uint image; uint how; uint size; float lod; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= size * size) return;
    vec2 st = (vec2(i % size, i / size) + 0.5) / float(size);
    colors.at[i] = textureLod(sampler2D(textures[image], samplers[how]), st, lod);
}
