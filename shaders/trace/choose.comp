#version 460
// Chooses for each pixel the light that it sends a ray to, and the point on it; direct.rgen sends the ray. A pass by itself,
// because a ray is followed faster the less has to be kept over it.
#include "trace/lights.glsl"
#include "trace/carry.glsl"
#include "trace/chosen.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    LightTask task = light_task(pixel);
    GBufferPixel g = task.surface;
    if (g.path < 0.0) return;
    rng_begin(uvec2(task.pixel), task.seed, 1);
    float random = rng_independent();
    LightSet set = lights_at(g.position, g.face_normal);
    LightSample chosen = no_light();
    if (set_count(set) > set.suns) {
        vec2 u = rng_next2();
        LightChoice choice = choose_resampled(set, g.position, g.normal, u.x);
        if (choice.weight > 0.0) chosen = sample_light(choice.light, g.position, g.normal, u);
        chosen.light *= choice.weight;
    }
    chosen_write(pixel, chosen, random, set.suns > 0);
}
