// The ray query tracer: a compute shader traverses the driver's structures, and decides candidates in a loop.
#ifndef RELIGHT_TRACE_QUERY_GLSL
#define RELIGHT_TRACE_QUERY_GLSL

#include "trace/candidate.glsl"

#define QUERY_HIT(query, committed) \
    Hit(uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, committed)) + uint(rayQueryGetIntersectionGeometryIndexEXT(query, committed)), \
        uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, committed)), rayQueryGetIntersectionBarycentricsEXT(query, committed), \
        rayQueryGetIntersectionTEXT(query, committed))

// See `trace_ray`.
Hit follow_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
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

// See `trace_layers`.
void follow_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    layers_clear(found);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scenes[VIEW.scene.top_level], gl_RayFlagsNoneEXT, mask, origin, layer_start(order), direction, tmax);
    // no candidate is confirmed; the list keeps the nearest
    while (rayQueryProceedEXT(query)) layers_add(found, QUERY_HIT(query, false), direction, order);
}

#endif
