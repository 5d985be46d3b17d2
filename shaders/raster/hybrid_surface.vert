#version 460
// Surfaces of the map at half the picture's size, for the rays of the hybrid look.
#include "raster/draw.glsl"

layout(location = 0) out vec3 out_world;
layout(location = 1) out float out_clip;

void main() {
    Draws draws = Draws(VIEW.draws);
    vec3 position = Vertices(VIEW.static_vertices).at[gl_VertexIndex].position;
    Instances instances = Instances(VIEW.instances);
    uint index = draws.at[gl_InstanceIndex].instance;
    mat3 axis = mat3(instances.at[index].axis[0], instances.at[index].axis[1], instances.at[index].axis[2]);
    out_world = axis * position + instances.at[index].origin;
    gl_Position = mat4(VIEW.world_to_clip[0], VIEW.world_to_clip[1], VIEW.world_to_clip[2], VIEW.world_to_clip[3]) * vec4(out_world, 1.0);
    out_clip = CLIP != 0 ? dot(VIEW.clip_plane.xyz, out_world) - VIEW.clip_plane.w : 0.0;
}
