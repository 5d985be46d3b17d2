#version 460
// Sides of shadow volumes, in world space.
#include "raster/shadow.glsl"

layout(location = 0) out float out_clip;

void main() {
    vec3 world = Positions(push.positions).at[gl_VertexIndex];
    gl_Position = push.world_to_clip * vec4(world, 1.0);
    out_clip = dot(push.clip_plane.xyz, world) - push.clip_plane.w;
}
