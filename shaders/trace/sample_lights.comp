#version 460
// Samples for each pixel a light and a point on it; `direct.rgen` traces the shadow ray. A pass of its own, because
// rays are traced faster with less live state.
#define SORTS_RAYS
#include "trace/lights.glsl"
#include "trace/gradient_reproject.glsl"
#include "trace/sampled_light.glsl"
#include "trace/suns.glsl"
#include "trace/clock.glsl"

layout(local_size_x = RAY_TILE, local_size_y = RAY_TILE) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    LightSample sampled = no_light();
    float random = 0.5;
    bool sun = false;
    if (inside(pixel)) {
        LightTask task = light_task(pixel);
        GBufferPixel g = task.surface;
        if (g.view_distance >= 0.0) {
            rng_begin(uvec2(task.pixel), task.seed, STREAM_LIGHT);
            random = rng_independent();
            LightSet set = lights_at(g.position, g.face_normal, g.normal);
            if (set_count(set) > set.suns) {
                vec2 u = rng_next2();
                LightChoice choice = sample_resampled(set, g.position, g.normal, u.x);
                if (choice.weight > 0.0) sampled = sample_light(choice.light, g.position, g.normal, u);
                sampled.light *= choice.weight;
            }
            sun = set.suns > 0 && max_component(sun_sample(task).light) > 0.0;
        }
    }
    // not the wait for the work group
    if (inside(pixel)) add_pixel_time(pixel);
    uint slot = ray_slot(sampled.direction, max_component(sampled.light) > 0.0);
    sampled_light_write(slot, gl_LocalInvocationID.xy, compacted_place(slot, sun), sampled, random);
}
