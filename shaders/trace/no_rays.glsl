// The tracer of passes that do what they can without a ray: where one is needed is noted, and what such a pass has found till
// then is void. It keeps nothing over a ray, so it is far faster than one that may send some; the same code compiled for
// another tracer then does what is left.
#ifndef RELIGHT_TRACE_NO_RAYS_GLSL
#define RELIGHT_TRACE_NO_RAYS_GLSL

#include "trace/candidate.glsl"

bool rays_wanted = false;

// Stands where a function goes on to send rays: without a tracer it ends there, with this answer.
#define NEEDS_RAYS(answer) { rays_wanted = true; return answer; }

Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    rays_wanted = true;
    return Hit(NO_HIT, 0, vec2(0.0), 0.0);
}

void trace_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    rays_wanted = true;
    layers_clear(found);
}

#endif
