// Selects the point of fog that a pixel lights. A path can cross several volumes: reservoir sampling keeps one with a
// probability proportional to its contribution, and a distance in it with the density of the scattering, so that only
// the light at the point remains to be estimated.
#ifndef RELIGHT_TRACE_FOG_KEEP_GLSL
#define RELIGHT_TRACE_FOG_KEEP_GLSL

#include "trace/fog.glsl"
#include "trace/random.glsl"
#include "trace/light_image.glsl"

// 1: fog of this map is lit. 0 removes the code.
layout(constant_id = 0) const uint LIT_FOG = 0;

// Largest part of a fog's colour that is single-scattered light; the rest is scattered many times and uniform.
const float MOST_LIT = 0.5;

// Mean light of the map's own lights in the volume, as displayed; excludes `rt_lightScale`, which must take effect.
vec3 fog_own_light(Fog fog) { return fog.own_light * exp2(VIEW.exposure.base); }

// Part of the fog's colour that is single-scattered light of the map's own lights, mean over the volume.
vec3 fog_lit_part(Fog fog) { return min(fog_own_light(fog), MOST_LIT); }

// Factor of the light beside the fog's colour, so that the mean of the map's own light becomes `lit`.
vec3 fog_scattering(Fog fog, vec3 lit) {
    vec3 own = fog_own_light(fog);
    return mix(vec3(1.0), lit / max(own, 1.0e-6), greaterThan(own, vec3(MOST_LIT)));
}

vec3 fog_weight = vec3(0.0);  // of all fog on the path
float fog_weight_sum = 0.0;
vec3 fog_tint = vec3(0.0);    // of the selected volume, divided by its selection weight
vec3 fog_point = vec3(0.0);
float fog_distance = -1.0;    // from the camera along the path

// `weight`: factor of the fog's light; `range`: of the ray inside the volume; `travelled`: length of the path before
// this ray.
void fog_keep(vec3 weight, vec2 range, vec3 origin, vec3 direction, float travelled) {
    float chance = max_component(weight);
    if (!(chance > 0.0)) return;
    fog_weight += weight;
    fog_weight_sum += chance;
    if (fog_weight_sum > chance && rng_next() * fog_weight_sum >= chance) return;
    fog_tint = weight / chance;
    // fog grows with the root of the length: equal steps of fog are squares of equal steps
    float root = rng_next();
    float t = mix(range.x, range.y, root * root);
    fog_point = origin + direction * t;
    fog_distance = travelled + t;
}

// Writes the selected point for the passes that light it, where its light will be.
void fog_write(ivec2 pixel) {
    bool filtered = (VIEW.fog.flags & FOG_FILTERED) != 0;
    // filtered light has no colour of its own, and the sum over the path has no noise
    vec3 weight = filtered ? fog_weight : fog_tint * fog_weight_sum;
    light_write(VIEW.fog.weight, pixel, weight, rng_independent());
    int cell = int(VIEW.fog.cell);
    ivec2 at = pixel / cell;
    // each pixel of a cell in turn; relative to the camera, where half floats are most precise
    ivec2 sampled = min(at * cell + ivec2(VIEW.seed, VIEW.seed >> 1) % cell, ivec2(VIEW.width, VIEW.height) - 1);
    if (pixel == sampled) imageStore(images_rgba16f[VIEW.fog.fresh], at, vec4(clamp(fog_point - VIEW.camera.origin, -60000.0, 60000.0), min(fog_distance, 60000.0)));
}

#endif
