// Traces the ray of a bounce.
#ifndef RELIGHT_TRACE_BOUNCE_TRACE_GLSL
#define RELIGHT_TRACE_BOUNCE_TRACE_GLSL

#ifdef SCATTERED
#include "trace/scattered.glsl"
#else
#include "trace/trace.glsl"
#endif

// The nearest hit that is not `Kind::Passed` (`renderer_vk/src/trace/input.rs`). The few rays that hit such a surface
// are traced again without surfaces that cast no shadow. A loop, because drivers inline functions: in a loop the
// traversal is compiled once.
Hit trace_bounce_rays(vec3 origin, float tmin, vec3 direction, uint mask) {
    Hit hit;
    for (uint i = 0; i < 2; i++) {
#ifdef SCATTERED
        hit = trace_scattered(origin, tmin, direction, FAR, mask, false);
#else
        hit = trace_ray(origin, tmin, direction, FAR, mask, false);
#endif
        if (hit.geometry == NO_HIT || Geometries(VIEW.scene.geometries).at[hit.geometry].kind != KIND_PASSED) break;
        mask &= ~MASK_NO_SHADOW;
    }
    return hit;
}

#endif
