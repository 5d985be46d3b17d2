// The point of fog whose light a pixel asks for. A path can see fog in several places; one of them is kept, with a chance
// that grows with what it contributes (reservoir sampling), and on its way through the volume a distance with the density
// of the scattering itself, so that what is left to know is the light there.
#ifndef RELIGHT_TRACE_FOG_KEEP_GLSL
#define RELIGHT_TRACE_FOG_KEEP_GLSL

#include "trace/fog.glsl"
#include "trace/random.glsl"
#include "trace/light_image.glsl"

// Fog of this map is lit: without, nothing of this is compiled in.
layout(constant_id = 0) const uint LIT_FOG = 0;

// Most that straight light may be of a fog's colour: the rest was scattered often, and is the same everywhere.
const float MOST_LIT = 0.5;

// The map's own light in a volume in the mean, as it is displayed; `rt_lightScale` does not count, which is to be seen.
vec3 fog_own_light(Fog fog) { return fog.own_light * exp2(VIEW.exposure.base); }

// The part of the fog's colour that is the map's own straight light, in the mean of the volume.
vec3 fog_lit_part(Fog fog) { return min(fog_own_light(fog), MOST_LIT); }

// What light is multiplied by, beside the fog's colour, so that the map's own comes to `lit` in the mean.
vec3 fog_scattering(Fog fog, vec3 lit) {
    vec3 own = fog_own_light(fog);
    return mix(vec3(1.0), lit / max(own, 1.0e-6), greaterThan(own, vec3(MOST_LIT)));
}

vec3 fog_weight = vec3(0.0);  // of all fog on the way
float fog_weight_sum = 0.0;
vec3 fog_tint = vec3(0.0);    // of the kept place, as a multiple of its chance
vec3 fog_point = vec3(0.0);
float fog_distance = -1.0;    // from the eye along the way

// `weight`: what the light of the fog is multiplied by; `range`: where the ray is in it; `travelled`: length of the path
// before its ray.
void fog_keep(vec3 weight, vec2 range, vec3 origin, vec3 direction, float travelled) {
    float chance = max_component(weight);
    if (!(chance > 0.0)) return;
    fog_weight += weight;
    fog_weight_sum += chance;
    if (fog_weight_sum > chance && rng_next() * fog_weight_sum >= chance) return;
    fog_tint = weight / chance;
    // fog grows with the root of the way in it: even steps of it are squares of even steps
    float root = rng_next();
    float t = mix(range.x, range.y, root * root);
    fog_point = origin + direction * t;
    fog_distance = travelled + t;
}

// Leaves what was kept for the passes that light it.
void fog_write(ivec2 pixel) {
    bool filtered = (VIEW.fog.flags & FOG_FILTERED) != 0;
    // filtered light has no colour of its own: the sum over the way is free of noise
    vec3 weight = filtered ? fog_weight : fog_tint * fog_weight_sum;
    light_write(VIEW.fog.weight, pixel, weight, rng_independent());
    int cell = int(VIEW.fog.cell);
    ivec2 at = pixel / cell;
    // each pixel of a cell in turn; from the eye, so that half floats are as exact as one sees
    ivec2 sampled = min(at * cell + ivec2(VIEW.seed, VIEW.seed >> 1) % cell, ivec2(VIEW.width, VIEW.height) - 1);
    if (pixel == sampled) imageStore(images_rgba16f[VIEW.fog.point], at, vec4(clamp(fog_point - VIEW.camera.origin, -60000.0, 60000.0), min(fog_distance, 60000.0)));
}

#endif
