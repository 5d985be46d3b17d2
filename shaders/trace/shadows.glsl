// Direct light of a point: sampled lights times visibility.
#ifndef RELIGHT_TRACE_SHADOWS_GLSL
#define RELIGHT_TRACE_SHADOWS_GLSL

#include "trace/lights.glsl"
#include "trace/trace.glsl"
#include "trace/filters.glsl"
#ifdef SCATTERED
#include "trace/scattered.glsl"
#endif

const uint MASK_SHADOW = MASK_SOLID | MASK_THIRD_SOLID;

// Mask of shadow rays. First-person geometry overlaps the third-person body and weapon of its carrier, which must not
// shadow it.
uint shadow_mask(bool first_person) { return first_person ? MASK_SOLID : MASK_SHADOW; }

// Visibility of the sample. A sun is visible if the ray hits sky first or leaves the map. For all other lights sky is
// solid: emitting sky surfaces are lights of their own, and a ray to one of them through another would count the same
// direction twice.
bool light_arrives(LightSample s, vec3 origin, uint mask) {
    if (!s.sky && s.distance <= 0.0) return true;
#ifdef SCATTERED
    Hit hit = trace_scattered(origin, 0.0, s.direction, s.distance, mask | MASK_SKY, !s.sky);
#else
    Hit hit = trace_ray(origin, 0.0, s.direction, s.distance, mask | MASK_SKY, !s.sky);
#endif
    return hit.geometry == NO_HIT || (s.sky && Geometries(VIEW.scene.geometries).at[hit.geometry].kind == KIND_SKY);
}

// Light of the sample that arrives. `mask`: see `shadow_mask`; `photons`: they bring what crosses refracting bodies.
vec3 arriving(LightSample s, vec3 origin, uint mask, bool photons) {
    if (!(max_component(s.light) > 0.0) || !light_arrives(s, origin, mask)) return vec3(0.0);
    Hit body = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    vec3 light = s.light * filtered(origin, s.direction, s.distance, photons, body);
    return body.geometry == NO_HIT ? light : vec3(0.0);
}

vec3 arriving(LightSample s, vec3 origin, uint mask) { return arriving(s, origin, mask, false); }

// Selects the lights of a set one after another, so that the sum of all selected ones, weighted, has the mean of the
// light of the whole set. Of a swept list, a light of the row that gives an ALL_RAYS-th of its estimated light or more
// is always selected; of the others each with a probability in proportion to its estimate, by systematic sampling. The
// lights that only the parent has are weak in this cell: PARENT_RAYS selections share them.
struct Enumeration {
    uint next; // members: slots of the row, suns, lights of this frame, then selections from the parent
    float scale; // probability over the estimate
    float phase; // a random number plus the sum of the probabilities so far
};

float slot_target(LightSlot slot, vec3 position, vec3 normal) {
    return light_target(slot.light, position, normal) * slot_visibility(slot);
}

Enumeration enumerate_begin(LightSet set, vec3 position, vec3 normal) {
    Enumeration e = Enumeration(0, 0.0, 0.0);
    if (!set.swept) return e;
    LightSlots slots = LightSlots(VIEW.lights.slots);
    float sum = 0.0;
    for (uint i = 0; i < set.listed; i++) sum += slot_target(slots.at[set.first + i], position, normal);
    if (sum > 0.0) e.scale = float(ALL_RAYS) / sum;
    e.phase = rng_next();
    return e;
}

// The next selected light; weight 0: none is left.
LightChoice enumerate_next(LightSet set, inout Enumeration e, vec3 position, vec3 normal, inout float u) {
    uint in_parent = set.parent == NO_PARENT ? 0 : PARENT_RAYS;
    while (e.next < set_count(set) + in_parent) {
        uint member = e.next++;
        if (member >= set_count(set)) {
            LightChoice choice = sample_parent(set, position, normal, u);
            choice.weight /= float(PARENT_RAYS);
            if (choice.weight > 0.0) return choice;
        } else if (set.swept && member < set.listed) {
            LightSlot slot = LightSlots(VIEW.lights.slots).at[set.first + member];
            float chance = min(slot_target(slot, position, normal) * e.scale, 1.0);
            float before = e.phase;
            e.phase += chance;
            if (chance == 1.0 || floor(e.phase) > floor(before)) return LightChoice(slot.light, 1.0 / chance, 0.0);
        } else return LightChoice(light_of_member(set, member), 1.0, 0.0);
    }
    return LightChoice(0, 0.0, 0.0);
}

// Direct light of a point with the geometric normal `face_normal`, by `samples` independent estimates. `photons`: see
// `arriving`.
vec3 direct_light(vec3 position, vec3 face_normal, vec3 normal, uint mask, uint selection, uint samples, bool photons) {
    LightSet set = lights_at(position, face_normal, normal);
    if (selection == SELECT_UNIFORM) set = whole_set(set);
    if (set_count(set) == 0) return vec3(0.0);
    vec3 origin = offset_ray(position, face_normal);
    vec3 sum = vec3(0.0);
    samples = max(samples, 1);
    bool all = selection == SELECT_ALL;
    Enumeration enumeration = Enumeration(0, 0.0, 0.0);
    if (all) enumeration = enumerate_begin(set, position, normal);
    // rays of one estimate
    uint rays = selection == SELECT_RESAMPLED && set.suns > 0 ? 2 : 1;
    for (uint i = 0; all || i < samples * rays; i++) {
        LightChoice choice;
        vec2 u = rng_next2();
        if (all) choice = enumerate_next(set, enumeration, position, normal, u.x);
        else if (selection == SELECT_UNIFORM) choice = sample_uniform(set, u.x);
        else if (i % rays == 1) choice = sample_sun(set.suns, u.x);
        else choice = sample_resampled(set, position, normal, u.x);
        if (!(choice.weight > 0.0)) {
            if (all) break;
            continue;
        }
        LightSample s = sample_light(choice.light, position, normal, u);
        s.light *= choice.weight;
        sum += arriving(s, origin, mask, photons);
    }
    return sum / float(samples);
}

#endif
