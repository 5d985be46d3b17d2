// The common interface of the tracers. Passes trace rays through these functions only, so that each pass is compiled
// for four tracers: the ray tracing pipeline, whose hit shaders report hits and decide cut-outs; in compute shaders ray
// queries (TRACER_QUERY), and without ray tracing hardware own hierarchies (TRACER_COMPUTE), with a uniform grid for the
// map's large part (TRACER_GRID in addition). A fifth tracer (TRACER_NONE) sends no rays, for pixels that need none.
#ifndef RELIGHT_TRACE_TRACE_GLSL
#define RELIGHT_TRACE_TRACE_GLSL

#include "trace/candidate.glsl"
#include "trace/count.glsl"
#include "trace/feedback.glsl"

#if defined(TRACER_COMPUTE) || defined(TRACER_QUERY) || defined(TRACER_NONE)

#ifdef TRACER_NONE
layout(local_size_x = 8, local_size_y = 8) in;
#else
layout(local_size_x = 8, local_size_y = 4) in;
#endif
#define LAUNCH_PIXEL ivec2(gl_GlobalInvocationID.xy)
#define LAUNCH_SLOT ((gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 32u + gl_LocalInvocationIndex)

#if defined(TRACER_COMPUTE)
#include "trace/bvh.glsl"
#elif defined(TRACER_NONE)
#include "trace/no_rays.glsl"
#else
#include "trace/query.glsl"
#endif

#else

#include "trace/payload.glsl"

#define LAUNCH_PIXEL ivec2(gl_LaunchIDEXT.xy)
#define LAUNCH_SLOT gl_LaunchIDEXT.x
layout(location = 0) rayPayloadEXT Payload payload;
layout(location = 1) rayPayloadEXT LayerPayload layer_payload;

Hit payload_hit() {
    return Hit(payload.geometry, payload.primitive, payload.barycentrics, payload.t);
}

// See `trace_ray`.
Hit follow_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    // the miss shader reports NO_HIT; without a report the ray is blocked
    payload.geometry = any_hit ? 0 : NO_HIT;
    if (CUT_OUTS != 0) payload.primitive = ray_cut_outs;
    uint flags = any_hit ? gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT : gl_RayFlagsNoneEXT;
    // the hit shader names what is counted
    if (HIT_FEEDBACK != 0) flags &= ~gl_RayFlagsSkipClosestHitShaderEXT;
    traceRayEXT(scenes[VIEW.scene.top_level], flags, mask, 0, 0, 0, origin, tmin, direction, tmax, 0);
    return payload_hit();
}

// See `trace_layers`.
void follow_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    layers_clear(layer_payload.found);
    layer_payload.last = order;
    const uint missed = 1;
    traceRayEXT(scenes[VIEW.scene.top_level], gl_RayFlagsSkipClosestHitShaderEXT, mask, 0, 0, missed, origin, layer_start(order), direction, tmax, 1);
    found = layer_payload.found;
}

#endif

#ifndef TRACER_NONE
// The nearest hit of the mask between tmin and tmax, without translucent surfaces. With `any_hit` only `geometry` is
// valid: NO_HIT if the ray hits nothing.
Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    ray_count++;
    uint start = clock_now();
    Hit hit = follow_ray(origin, tmin, direction, tmax, mask, any_hit);
    ray_ticks += clock_now() - start;
    count_hit(hit.geometry);
    count_boxes(LAUNCH_PIXEL, origin, direction, hit.geometry == NO_HIT ? tmax : hit.t);
    return hit;
}

// The next translucent layers behind `order` and before tmax. Layers in one plane are ordered as the engine draws them,
// the last drawn first.
void trace_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    ray_count++;
    uint start = clock_now();
    follow_layers(origin, direction, tmax, mask, order, found);
    ray_ticks += clock_now() - start;
    for (uint i = 0; i < LAYERS_A_RAY; i++) {
        if (found.keys[i] < LAYER_NONE) count_hit(found.hits[i].geometry);
    }
    // a body is found by a ray for layers alone
    count_boxes(LAUNCH_PIXEL, origin, direction, tmax);
}

// See `no_rays.glsl`.
const bool rays_needed = false;
const bool HAS_RAYS = true;
#define NEEDS_RAYS(answer)
#endif

#endif
