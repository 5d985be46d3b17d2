#version 460
// Surfaces of the map at half the picture's size, for the rays of the hybrid look; with MIRROR, surfaces of map and models
// that reflect, with their vertex normals.
// variants: MIRROR=-DMIRROR
#include "raster/draw.glsl"

layout(location = 0) out vec3 out_world;
layout(location = 1) out float out_clip;
#ifdef MIRROR
layout(location = 2) out vec3 out_normal;
layout(location = 3) out flat float out_first_person;
#endif

// a surface of the map has the same depth in both
invariant gl_Position;

void main() {
    Draws draws = Draws(VIEW.draws);
    Vertices vertices = Vertices(draws.at[gl_InstanceIndex].dynamic_vertices != 0 ? VIEW.dynamic_vertices : VIEW.static_vertices);
    vec3 position = vertices.at[gl_VertexIndex].position;
    Instances instances = Instances(VIEW.instances);
    uint index = draws.at[gl_InstanceIndex].instance;
    mat3 axis = mat3(instances.at[index].axis[0], instances.at[index].axis[1], instances.at[index].axis[2]);
    out_world = axis[0] * position.x + axis[1] * position.y + axis[2] * position.z + instances.at[index].origin;
    gl_Position = mat4(VIEW.world_to_clip[0], VIEW.world_to_clip[1], VIEW.world_to_clip[2], VIEW.world_to_clip[3]) * vec4(out_world, 1.0);
    out_clip = CLIP != 0 ? dot(VIEW.clip_plane.xyz, out_world) - VIEW.clip_plane.w : 0.0;
#ifdef MIRROR
    out_normal = axis * vertices.at[gl_VertexIndex].normal;
    out_first_person = (instances.at[index].flags & (INSTANCE_FIRST_PERSON | INSTANCE_DEPTH_HACK)) != 0 ? 1.0 : 0.0;
#endif
}
