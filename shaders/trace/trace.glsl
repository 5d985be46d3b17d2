// The tracer: how a pass asks for rays. Passes use these functions only, so the same pass is compiled for two tracers:
// the ray tracing pipeline, whose hit shaders report what was hit and decide cut-outs, and (TRACER_COMPUTE) our own
// hierarchies walked in a compute shader, which needs no ray tracing hardware.
#ifndef RELIGHT_TRACE_TRACE_GLSL
#define RELIGHT_TRACE_TRACE_GLSL

#include "trace/geometry.glsl"
#include "trace/layer_order.glsl"

// The place of a translucent layer in the order along a ray, nearest first.
struct LayerOrder {
    float key;
    uint geometry;
    uint primitive;
};

LayerOrder layer_begin() { return LayerOrder(-1.0e30, NO_HIT, NO_HIT); }

#ifdef TRACER_COMPUTE

#include "trace/bvh.glsl"

layout(local_size_x = 8, local_size_y = 4) in;
#define LAUNCH_PIXEL ivec2(gl_GlobalInvocationID.xy)

#else

#include "trace/payload.glsl"

#define LAUNCH_PIXEL ivec2(gl_LaunchIDEXT.xy)
layout(location = 0) rayPayloadEXT Payload payload;

Hit payload_hit() {
    return Hit(payload.geometry, payload.primitive, payload.barycentrics, payload.t);
}

// The nearest thing of the mask between tmin and tmax, translucent ones left out; with `any_hit` only whether there is
// one: `geometry` is NO_HIT if not, and nothing else of the answer counts.
Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    // where nothing reports, the ray was blocked
    payload.geometry = any_hit ? 0 : NO_HIT;
    payload.key = 1.0e30;
    uint flags = any_hit ? gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT : gl_RayFlagsNoneEXT;
    traceRayEXT(scenes[VIEW.scene], flags, mask, 0, 0, 0, origin, tmin, direction, tmax, 0);
    return payload_hit();
}

// The next translucent layer behind `order` and before tmax; moves `order` to it. Layers in one plane come in the
// order of the engine, what it draws last first.
Hit trace_layer(vec3 origin, vec3 direction, float tmax, uint mask, inout LayerOrder order) {
    payload.geometry = NO_HIT;
    payload.key = 1.0e30;
    payload.last_key = order.key;
    payload.last_geometry = order.geometry;
    payload.last_primitive = order.primitive;
    // a layer lies at its key or a bias behind it
    float tmin = max(order.key - 0.01, 0.0);
    traceRayEXT(scenes[VIEW.scene], gl_RayFlagsSkipClosestHitShaderEXT, mask, 0, 0, 0, origin, tmin, direction, tmax, 0);
    Hit hit = payload_hit();
    if (payload.key >= 1.0e30) hit.geometry = NO_HIT;
    else order = LayerOrder(payload.key, hit.geometry, hit.primitive);
    return hit;
}

#endif

#endif
