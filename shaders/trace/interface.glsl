// Where rays meet glass and liquids: the reflectance, and the normal about which a ray is reflected or refracted.
#ifndef RELIGHT_TRACE_INTERFACE_GLSL
#define RELIGHT_TRACE_INTERFACE_GLSL
#include "trace/specular.glsl"
#include "trace/dielectric.glsl"
#include "trace/random.glsl"

// How reflection or refraction has distorted a path: not at all; by a static shape; by ripples, which move with time.
const uint BENT_NOT = 0, BENT_BY_SHAPE = 1, BENT_BY_RIPPLES = 2;

// The surface of glass or a liquid where a ray meets it. `face`: geometric normal on the ray's side; `normal`: shading
// normal, distorted by ripples and roughness; `eta`: ratio of the indices of refraction; `bend`: BENT_*.
struct Interface {
    vec3 face;
    vec3 normal;
    float eta;
    float mirrored; // share of the light that is reflected
    uint bend;
    bool refracts;
    bool enters;
    float frost; // width of the distribution of its microfacets; 0: smooth
};

// Whether glass is frosted: while frames accumulate. Live frames show it clear, because pixels that see another surface each
// frame, or each another one than its neighbour, have neither history nor neighbours to filter with.
bool is_frosted(Material material) {
    return HAS_GLOSS != 0 && (material.flags & MATERIAL_ROUGH) != 0 && (VIEW.flags & VIEW_ACCUMULATE) != 0;
}

// `width`: of the ray, units.
Interface interface_at(vec3 direction, SurfacePoint p, Material material, float width) {
    Dielectric dielectric = material.dielectric;
    Interface i;
    bool solid = (p.triangle.flags & TRIANGLE_SOLID) != 0;
    i.refracts = refracts(material, p);
    i.enters = dot(p.face_normal, direction) < 0.0;
    i.face = i.enters ? p.face_normal : -p.face_normal;
    vec3 smooth_normal = dot(p.normal, i.face) < 0.0 ? -p.normal : p.normal;
    i.normal = ripple_normal(solid ? smooth_normal : i.face, p.position, dielectric.ripple, width, p.stage.time);
    float cosine = -dot(i.normal, direction);
    if (cosine <= 0.0) {
        i.normal = i.face;
        cosine = -dot(i.face, direction);
    }
    i.bend = dielectric.ripple > 0.0 ? BENT_BY_RIPPLES : BENT_BY_SHAPE;
    i.frost = 0.0;
    if (is_frosted(material)) {
        float rough = max(material.specular.roughness, LEAST_ROUGHNESS);
        i.frost = rough * rough;
        i.normal = sample_facet(i.frost, i.normal, -direction, rng_next2());
        cosine = max(-dot(i.normal, direction), 0.0);
        i.bend = BENT_BY_RIPPLES;
    }
    i.eta = !i.refracts || i.enters ? dielectric.index : 1.0 / dielectric.index;
    i.mirrored = dielectric_reflectance(material, p, cosine, i.eta);
    return i;
}

// Direction of a ray that passes the surface; a ripple may refract it backwards, and it continues straight then.
vec3 refracted_direction(vec3 direction, Interface i) {
    vec3 refracted = refract(direction, i.normal, 1.0 / i.eta);
    return normalize(dot(refracted, i.face) >= 0.0 ? direction : refracted);
}

#endif
