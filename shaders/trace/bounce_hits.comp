#version 460
// Shades the hits of `bounce_rays.rgen` and samples a light for each; `bounce_light.rgen` traces the shadow rays.
#include "trace/bounce_ray.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(cell, bounce_cells()))) return;
    LightTask task = light_task(subsample_pixel(cell));
    BounceLight b = BounceLight(vec3(0.0), no_light(), vec3(0.0));
    float random = 0.5;
    vec3 throughput;
    Hit hit = bounce_hit_read(cell, throughput);
    if (gathers(task)) {
        random = bounce_random(task);
        PathVertex v = first_vertex(task);
        vec3 direction;
        bounce_direction(v, direction);
        vec3 origin = offset_ray(v.position, v.face_normal);
        if (hit.geometry != NO_HIT && bounce_shade(hit, origin, direction, throughput, b.found, v)) {
            b.light = vertex_light(v);
            b.light.light *= throughput;
            b.origin = offset_ray(v.position, v.face_normal);
        }
    }
    bounce_light_write(cell, b, random);
}
