// The shadow ray to a sun, in addition to the ray to another light: as one of the sampled lights, an occluded sun would
// outweigh all lights that reach its shadow.
#ifndef RELIGHT_TRACE_SUNS_GLSL
#define RELIGHT_TRACE_SUNS_GLSL

#include "trace/lights.glsl"
#include "trace/gradient_reproject.glsl"

// Where the cosine to a sun is below this, fewer rays are traced, with larger weights: walls below a sun overhead see
// only the edge of its disc, and half of their rays would contribute next to nothing.
const float WEAK_SUN = 1.0 / 64.0;

// Unshadowed light of the sample; none if no ray is to be traced. Every pass gets the same sample.
LightSample sun_sample(LightTask task) {
    rng_begin(uvec2(task.pixel), task.seed, STREAM_SUN);
    vec2 u = rng_next2();
    LightChoice sun = sample_sun(VIEW.lights.sun_count, u.x);
    LightSample s = sample_light(sun.light, task.surface.position, task.surface.normal, u);
    float part = dot(task.surface.normal, s.direction);
    if (part < WEAK_SUN) {
        if (!(part > 0.0) || rng_next() * WEAK_SUN >= part) return no_light();
        s.light *= WEAK_SUN / part;
    }
    s.light *= sun.weight;
    return s;
}

#endif
