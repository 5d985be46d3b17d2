#version 460
// variants: TWICE=-DFACTOR=2
// Test of the gpu layer: writes coordinates into a storage image by its index, and sums a buffer by its address.
#include "common/bindless.glsl"

#ifndef FACTOR
#define FACTOR 1
#endif

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 3) const uint ADDED = 0;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Numbers { uint at[]; };
layout(push_constant, scalar) uniform Push { Numbers numbers; Numbers sums; uint image; uint width; uint height; uint count; };

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x < width && pixel.y < height)
        imageStore(images_rgba32f[image], ivec2(pixel), vec4(pixel, ADDED, 1.0));
    if (pixel == uvec2(0)) {
        uint sum = ADDED;
        for (uint i = 0; i < count; i++) sum += numbers.at[i];
        sums.at[0] = sum * FACTOR;
    }
}
