#version 460
// Test of directions in 2 x 24 bits: what becomes of them, and of the numbers beside them.
#include "common/bindless.glsl"
#include "trace/direction.glsl"

layout(local_size_x = 64) in;

struct Kept { vec3 direction; uint spare; };

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Directions { Kept at[]; };
layout(push_constant, scalar) uniform Push { Directions directions; uint count; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= count) return;
    Kept k = directions.at[index];
    uvec2 packed = pack_direction(k.direction, uvec2(k.spare & 255u, k.spare >> 8));
    uvec2 spare = spare_of_direction(packed);
    directions.at[index] = Kept(unpack_direction(packed), spare.x | spare.y << 8);
}
