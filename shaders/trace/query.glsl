// The ray query tracer: the driver's structures, walked from a compute shader; candidates are decided in a loop here.
#ifndef RELIGHT_TRACE_QUERY_GLSL
#define RELIGHT_TRACE_QUERY_GLSL

#include "trace/candidate.glsl"

#define QUERY_HIT(query, committed) \
    Hit(uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, committed)) + uint(rayQueryGetIntersectionGeometryIndexEXT(query, committed)), \
        uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, committed)), rayQueryGetIntersectionBarycentricsEXT(query, committed), \
        rayQueryGetIntersectionTEXT(query, committed))

// The nearest thing of the mask between tmin and tmax, translucent ones left out; with `any_hit` only whether there is
// one: `geometry` is NO_HIT if not, and nothing else of the answer counts.
Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    rays_asked++;
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

// The next translucent layers behind `order` and before tmax. Layers in one plane come in the order of the engine, what
// it draws last first.
void trace_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    rays_asked++;
    layers_clear(found);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scenes[VIEW.scene.top_level], gl_RayFlagsNoneEXT, mask, origin, layer_start(order), direction, tmax);
    // none is ever confirmed: the nearest so far are noted
    while (rayQueryProceedEXT(query)) layers_add(found, QUERY_HIT(query, false), direction, order);
}

#endif
