#version 460
// Triangles of a geometry record, the instance of the draw, for the image of first hits.
#include "trace/first_hits.glsl"
#include "trace/primary_hit.glsl"

// index of the geometry plus 1; triangle, with PRIMARY_HIT_FIRST_PERSON
layout(location = 0) out flat uvec2 out_hit;

void main() {
    uint geometry = gl_InstanceIndex, primitive = gl_VertexIndex / 3;
    mat3 corners = drawn_corners(Geometries(VIEW.scene.geometries).at[geometry], primitive);
    vec3 corner = corners[gl_VertexIndex % 3];
    vec3 place = vec3(dot(push.to_picture[0], corner), dot(push.to_picture[1], corner), dot(push.to_picture[2], corner));
    // depth falls from 1 at the near plane to 0: floats then have the same relative precision at all distances
    gl_Position = vec4(place.xy, VIEW.camera.near, place.z);
    // a corner that is not finite: no ray hits the triangle
    vec3 sum = abs(corners[0]) + abs(corners[1]) + abs(corners[2]);
    if (!(sum.x + sum.y + sum.z < 1.0e9)) gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
    out_hit = uvec2(geometry + 1, primitive & ~PRIMARY_HIT_BITS | (push.first_person != 0 ? PRIMARY_HIT_FIRST_PERSON : 0u));
}
