// The tracer of passes without rays. Where the code needs a ray, it sets `rays_needed`, and the invocation's results
// are invalid; the same code, compiled for another tracer, handles these pixels. Without state that is live across rays
// this tracer is far faster.
#ifndef RELIGHT_TRACE_NO_RAYS_GLSL
#define RELIGHT_TRACE_NO_RAYS_GLSL

#include "trace/candidate.glsl"

bool rays_needed = false;
// Constant, so that a compiler removes code behind rays.
const bool HAS_RAYS = false;

// Placed before code that traces rays: without a tracer the function returns `answer` here.
#define NEEDS_RAYS(answer) { rays_needed = true; return answer; }

Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    rays_needed = true;
    return Hit(NO_HIT, 0, vec2(0.0), 0.0);
}

void trace_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    rays_needed = true;
    layers_clear(found);
}

#endif
