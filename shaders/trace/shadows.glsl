// Direct light of a point: sampled lights times visibility.
#ifndef RELIGHT_TRACE_SHADOWS_GLSL
#define RELIGHT_TRACE_SHADOWS_GLSL

#include "trace/lights.glsl"
#include "trace/trace.glsl"
#include "trace/filters.glsl"

const uint MASK_SHADOW = MASK_SOLID | MASK_THIRD_SOLID;

// Mask of shadow rays. First-person geometry overlaps the third-person body and weapon of its carrier, which must not
// shadow it.
uint shadow_mask(bool first_person) { return first_person ? MASK_SOLID : MASK_SHADOW; }

// Visibility of the sample. A sun is visible if the ray hits sky first or leaves the map. For all other lights sky is
// solid: emitting sky surfaces are lights of their own, and a ray to one of them through another would count the same
// direction twice.
bool light_arrives(LightSample s, vec3 origin, uint mask) {
    if (!s.sky && s.distance <= 0.0) return true;
    Hit hit = trace_ray(origin, 0.0, s.direction, s.distance, mask | MASK_SKY, !s.sky);
    return hit.geometry == NO_HIT || (s.sky && Geometries(VIEW.scene.geometries).at[hit.geometry].kind == KIND_SKY);
}

// Light of the sample that arrives. `mask`: see `shadow_mask`.
vec3 arriving(LightSample s, vec3 origin, uint mask) {
    if (!(max_component(s.light) > 0.0) || !light_arrives(s, origin, mask)) return vec3(0.0);
    return s.light * filtered(origin, s.direction, s.distance);
}

// Direct light of a point with the geometric normal `face_normal`, by `samples` independent estimates.
vec3 direct_light(vec3 position, vec3 face_normal, vec3 normal, uint mask, uint selection, uint samples) {
    LightSet set = lights_at(position, face_normal, normal);
    uint count = set_count(set);
    if (count == 0) return vec3(0.0);
    vec3 origin = offset_ray(position, face_normal);
    vec3 sum = vec3(0.0);
    samples = max(samples, 1);
    // rays of one estimate, and how many of them sample a light
    uint rays = 1, picks = 1;
    LightSet from = set;
    if (selection == SELECT_ALL) {
        // one ray for each strong light; a few of the weak lights are sampled by their contribution
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
