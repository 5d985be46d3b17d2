// The tracer: how a pass asks for rays. Passes use these three functions only, so the same pass can be compiled for
// another tracer. This one is the ray tracing pipeline; its hit shaders report what was hit and decide cut-outs.
#ifndef RELIGHT_TRACE_TRACE_GLSL
#define RELIGHT_TRACE_TRACE_GLSL

#include "trace/geometry.glsl"
#include "trace/payload.glsl"

layout(location = 0) rayPayloadEXT Payload payload;

Hit payload_hit() {
    return Hit(payload.geometry, payload.primitive, payload.barycentrics, payload.t);
}

// The nearest solid (or sky, if the mask asks for it) between tmin and tmax.
Hit trace_closest(vec3 origin, float tmin, vec3 direction, float tmax, uint mask) {
    payload.geometry = NO_HIT;
    payload.key = 1.0e30;
    traceRayEXT(scenes[VIEW.scene], gl_RayFlagsNoneEXT, mask, 0, 0, 0, origin, tmin, direction, tmax, 0);
    return payload_hit();
}

// Whether anything of the mask lies between tmin and tmax.
bool trace_blocked(vec3 origin, float tmin, vec3 direction, float tmax, uint mask) {
    payload.geometry = 0;
    payload.key = 1.0e30;
    traceRayEXT(scenes[VIEW.scene], gl_RayFlagsTerminateOnFirstHitEXT | gl_RayFlagsSkipClosestHitShaderEXT, mask, 0, 0, 0,
        origin, tmin, direction, tmax, 0);
    return payload.geometry != NO_HIT;
}

// The place of a translucent layer in the order along a ray, nearest first.
struct LayerOrder {
    float key;
    uint geometry;
    uint primitive;
};

LayerOrder layer_begin() { return LayerOrder(-1.0e30, NO_HIT, NO_HIT); }

// The next translucent layer behind `order` and before tmax; moves `order` to it. Layers in one plane come in the
// order of the engine, what it draws last first.
Hit trace_layer(vec3 origin, vec3 direction, float tmax, uint mask, inout LayerOrder order) {
    payload.geometry = NO_HIT;
    payload.key = 1.0e30;
    payload.last_key = order.key;
    payload.last_geometry = order.geometry;
    payload.last_primitive = order.primitive;
    // the bias of the keys is below 1; rays are traced a little wider than that
    float tmin = max(order.key - 0.01, 0.0);
    traceRayEXT(scenes[VIEW.scene], gl_RayFlagsSkipClosestHitShaderEXT, mask, 0, 0, 0, origin, tmin, direction, tmax, 0);
    Hit hit = payload_hit();
    if (payload.key >= 1.0e30) hit.geometry = NO_HIT;
    else order = LayerOrder(payload.key, hit.geometry, hit.primitive);
    return hit;
}

#endif
