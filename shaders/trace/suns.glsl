// The ray that a pixel sends to a sun, besides that to another light: a sun that something hides would outshine all that is
// left in its shadow, were it one of them.
#ifndef RELIGHT_TRACE_SUNS_GLSL
#define RELIGHT_TRACE_SUNS_GLSL

#include "trace/lights.glsl"
#include "trace/gradient_reproject.glsl"

// Where less than this part of a sun's light falls, fewer rays are sent, each for as much more: walls below a sun that
// stands overhead see the edge of its disc, and so would send every other of their rays for next to nothing.
const float WEAK_SUN = 1.0 / 64.0;

// Its light without shadows; none where no ray is to be sent. The same for every pass that asks.
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
