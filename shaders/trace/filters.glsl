// Surfaces that light passes and takes its colour from: tinted glass and filters. Liquids leave it as it is, as for maps'
// compilers: the light that was measured in them has lost nothing on its way, and would be taken from twice.
//
// The colour is the mean over the surface, so that a shadow ray runs no stages. Light goes straight through: what
// refraction would focus (caustics) is spread evenly, which keeps its mean.
#ifndef RELIGHT_TRACE_FILTERS_GLSL
#define RELIGHT_TRACE_FILTERS_GLSL

#include "trace/boxes.glsl"
#include "trace/trace.glsl"
#include "trace/dielectric.glsl"

// Filters on one ray that are counted; behind more of them there is hardly light left.
const uint MAX_FILTERS = 8;
// A filter this near to where the ray starts is a layer of the surface itself, units.
const float FILTER_CLEARANCE = 0.25;

// Whether the ray comes near such a surface at all.
bool meets_filter(vec3 origin, vec3 direction, float distance) {
    return meets_box(Boxes(VIEW.transport.filters), VIEW.transport.filter_count, origin, direction, distance);
}

// What light that comes along the ray is multiplied by.
vec3 filtered(vec3 origin, vec3 direction, float distance) {
    vec3 color = vec3(1.0);
    if (VIEW.transport.filter_count == 0 || !meets_filter(origin, direction, distance)) return color;
    LayerOrder order = layer_begin();
    LayerList found;
    for (uint i = 0; i < MAX_FILTERS; i++) {
        if (i % LAYERS_A_RAY == 0) trace_layers(origin, direction, distance, MASK_TRANSLUCENT, order, found);
        Hit hit = layers_take(found, order);
        if (hit.geometry == NO_HIT) break;
        SurfacePoint p = surface_point(hit);
        Dielectric dielectric = material_of(p.triangle.material).dielectric;
        if (dielectric.filters == 0 || (p.triangle.flags & TRIANGLE_WORLD) == 0) continue;
        if (hit.t < FILTER_CLEARANCE) continue;
        color *= dielectric.filter_color;
        // light comes the other way and is never totally reflected from outside
        if (dielectric.index > 0.0) color *= 1.0 - fresnel(abs(dot(p.face_normal, direction)), dielectric.index);
        if (max_component(color) <= 0.0) break;
    }
    return color;
}

#endif
