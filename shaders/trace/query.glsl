// The ray query tracer: a compute shader traverses the driver's structures, and decides candidates in a loop.
#ifndef RELIGHT_TRACE_QUERY_GLSL
#define RELIGHT_TRACE_QUERY_GLSL

#include "trace/candidate.glsl"

#define QUERY_HIT(query, committed) \
    Hit(uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, committed)) + uint(rayQueryGetIntersectionGeometryIndexEXT(query, committed)), \
        uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, committed)), rayQueryGetIntersectionBarycentricsEXT(query, committed), \
        rayQueryGetIntersectionTEXT(query, committed))

// The nearest hit of the mask between tmin and tmax, without translucent surfaces. With `any_hit` only `geometry` is
// valid: NO_HIT if the ray hits nothing.
Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    ray_count++;
    rayQueryEXT query;
    uint flags = any_hit ? gl_RayFlagsTerminateOnFirstHitEXT : gl_RayFlagsNoneEXT;
    rayQueryInitializeEXT(query, scenes[VIEW.scene.top_level], flags, mask, origin, tmin, direction, tmax);
    while (rayQueryProceedEXT(query)) {
        if (is_stopped_by(QUERY_HIT(query, false), direction)) rayQueryConfirmIntersectionEXT(query);
    }
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT)
        return Hit(NO_HIT, 0, vec2(0.0), 0.0);
    return QUERY_HIT(query, true);
}

// The next translucent layers behind `order` and before tmax. Layers in one plane are ordered as the engine draws them,
// the last drawn first.
void trace_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    ray_count++;
    layers_clear(found);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scenes[VIEW.scene.top_level], gl_RayFlagsNoneEXT, mask, origin, layer_start(order), direction, tmax);
    // no candidate is confirmed; the list keeps the nearest
    while (rayQueryProceedEXT(query)) layers_add(found, QUERY_HIT(query, false), direction, order);
}

#endif
