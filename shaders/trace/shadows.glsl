// Direct light on a point: the lights that were sampled, as far as something is in the way of their light.
#ifndef RELIGHT_TRACE_SHADOWS_GLSL
#define RELIGHT_TRACE_SHADOWS_GLSL

#include "trace/lights.glsl"
#include "trace/trace.glsl"
#include "trace/filters.glsl"

const uint MASK_SHADOW = MASK_SOLID | MASK_THIRD_SOLID;

// What is in the way of light to a surface. A weapon before the eye is where others see the body of its bearer, and the
// same weapon once more: neither is in its light.
uint shadow_mask(bool first_person) { return first_person ? MASK_SOLID : MASK_SHADOW; }

// Whether the sample's light arrives. Suns arrive where the ray meets sky first or leaves the map. For all other lights
// sky is as solid as a wall: pieces of sky that shine are lights of their own, and a ray to one that passes another would
// count the same direction twice.
bool light_arrives(LightSample s, vec3 origin, uint mask) {
    if (!s.sky && s.distance <= 0.0) return true;
    Hit hit = trace_ray(origin, 0.0, s.direction, s.distance, mask | MASK_SKY, !s.sky);
    return hit.geometry == NO_HIT || (s.sky && Geometries(VIEW.scene.geometries).at[hit.geometry].kind == KIND_SKY);
}

// What arrives of a sample's light. `mask`: see shadow_mask.
vec3 arriving(LightSample s, vec3 origin, uint mask) {
    if (!(max_component(s.light) > 0.0) || !light_arrives(s, origin, mask)) return vec3(0.0);
    return s.light * filtered(origin, s.direction, s.distance);
}

// Direct light on a point whose surface faces `face_normal`, with `samples` independent estimates.
vec3 direct_light(vec3 position, vec3 face_normal, vec3 normal, uint mask, uint selection, uint samples) {
    LightSet set = lights_at(position, face_normal, normal);
    uint count = set_count(set);
    if (count == 0) return vec3(0.0);
    vec3 origin = offset_ray(position, face_normal);
    vec3 sum = vec3(0.0);
    samples = max(samples, 1);
    // rays of one estimate, and those of them that pick a light
    uint rays = 1, picks = 1;
    LightSet from = set;
    if (selection == SELECT_ALL) {
        // each light has its ray, but of the weak ones, which give little together, some are picked by what they give
        uint weak = set.listed - set.strong;
        from = LightSet(set.first + set.listed, weak, 0, 0, 0, 0);
        picks = min(weak, WEAK_RAYS);
        rays = picks + count - weak;
    } else if (selection == SELECT_RESAMPLED && set.suns > 0) rays = 2;
    for (uint i = 0; i < samples * rays; i++) {
        uint ray = i % rays;
        LightChoice choice;
        vec2 u = rng_next2();
        if (selection == SELECT_UNIFORM) choice = sample_uniform(set, u.x);
        else if (ray >= picks && selection == SELECT_ALL) {
            uint member = ray - picks;
            if (member >= set.strong) member += from.listed;
            choice = LightChoice(light_of_member(set, member), 1.0, 0.0);
        } else if (ray >= picks) choice = sample_sun(set.suns, u.x);
        else {
            choice = sample_resampled(from, position, normal, u.x);
            choice.weight /= float(picks);
        }
        if (!(choice.weight > 0.0)) continue;
        LightSample s = sample_light(choice.light, position, normal, u);
        s.light *= choice.weight;
        sum += arriving(s, origin, mask);
    }
    return sum / float(samples);
}

#endif
