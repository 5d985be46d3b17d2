// Surfaces that tint the light that passes them: tinted glass and filters. Liquids do not: map compilers apply no
// absorption in them, so the light measured in liquids would be reduced twice.
//
// The tint is the mean over the surface, so that a shadow ray evaluates no stages. Light passes straight through: the
// light that refraction would focus is spread evenly, with the same mean. Photons (`photons.rgen`) refract it instead.
#ifndef RELIGHT_TRACE_FILTERS_GLSL
#define RELIGHT_TRACE_FILTERS_GLSL

#include "trace/boxes.glsl"
#include "trace/trace.glsl"
#include "trace/dielectric.glsl"

// Most filters on one ray; hardly any light passes more of them.
const uint MAX_FILTERS = 8;
// A filter nearer than this to the start of the ray is a layer of the same surface, units.
const float FILTER_CLEARANCE = 0.25;

// Whether the ray passes near a filter; with `bodies`, or near a refracting body.
bool meets_filter(vec3 origin, vec3 direction, float distance, bool bodies) {
    if (bodies && meets_box(Boxes(VIEW.photons.boxes), VIEW.photons.box_count, origin, direction, distance)) return true;
    return VIEW.transport.filter_count > 0 && meets_box(Boxes(VIEW.transport.filters), VIEW.transport.filter_count, origin, direction, distance);
}

// Transmittance of the filters along the ray. With `bodies` the ray ends at the first refracting body, which replaces
// `body`.
vec3 filtered(vec3 origin, vec3 direction, float distance, bool bodies, inout Hit body) {
    vec3 color = vec3(1.0);
    if (!meets_filter(origin, direction, distance, bodies)) return color;
    LayerOrder order = layer_begin();
    LayerList found;
    for (uint i = 0; i < MAX_FILTERS; i++) {
        if (i % LAYERS_A_RAY == 0) trace_layers(origin, direction, distance, MASK_TRANSLUCENT, order, found);
        Hit hit = layers_take(found, order);
        if (hit.geometry == NO_HIT) break;
        SurfacePoint p = surface_point(hit);
        Dielectric dielectric = material_of(p.triangle.material).dielectric;
        if (bodies && (p.triangle.flags & TRIANGLE_BODY) != 0) {
            body = hit;
            break;
        }
        if (dielectric.filters == 0 || (p.triangle.flags & TRIANGLE_WORLD) == 0) continue;
        if (hit.t < FILTER_CLEARANCE) continue;
        // a body's tint counts once
        if ((p.triangle.flags & TRIANGLE_SOLID) != 0 && dot(p.face_normal, direction) > 0.0) continue;
        color *= dielectric.filter_color;
        // the light travels against the ray, so it enters from outside, without total reflection
        if (dielectric.index > 0.0) color *= 1.0 - fresnel(abs(dot(p.face_normal, direction)), dielectric.index);
        if (max_component(color) <= 0.0) break;
    }
    return color;
}

// Transmittance of filters and refracting bodies along the ray.
vec3 filtered(vec3 origin, vec3 direction, float distance) {
    Hit none = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    return filtered(origin, direction, distance, false, none);
}

#endif
