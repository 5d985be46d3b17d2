#version 460
// Geometry and triangle of a pixel's first hit; with TESTED, of triangles that a ray may pass.
// variants: TESTED=-DTESTED
#include "trace/first_hits.glsl"
#ifdef TESTED
#include "trace/candidate.glsl"
#include "trace/camera.glsl"
#include "trace/primary_hit.glsl"
#endif

layout(location = 0) in flat uvec2 in_hit;
layout(location = 0) out uvec2 out_hit;

void main() {
#ifdef TESTED
    vec3 direction = camera_ray(ivec2(gl_FragCoord.xy)).direction;
    Hit hit = hit_of_triangle(in_hit.x - 1, in_hit.y & ~PRIMARY_HIT_BITS, direction);
    if (!is_stopped_by(hit, direction)) discard;
#endif
    out_hit = in_hit;
}
