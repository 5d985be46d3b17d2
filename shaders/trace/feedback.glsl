// Counts rays for `rt_hitFeedback`: those that hit the geometry of a body, and those that pass the boxes of a grid.
#ifndef RELIGHT_TRACE_FEEDBACK_GLSL
#define RELIGHT_TRACE_FEEDBACK_GLSL

#include "trace/view.glsl"

// 1: rays are counted.
layout(constant_id = 11) const uint HIT_FEEDBACK = 0;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FeedbackCounters { uint at[]; };

// Other invocations may have raised the counter beyond what is read: it may end above the limit.
void count_ray(uint place) {
    FeedbackCounters counters = FeedbackCounters(VIEW.feedback.counters);
    if (counters.at[place] < FEEDBACK_MOST) atomicAdd(counters.at[place], 1);
}

// Counts a hit of a body. `NO_HIT` and the map's geometry are not in the range.
void count_hit(uint geometry) {
    if (HIT_FEEDBACK == 0) return;
    uint place = geometry - VIEW.feedback.first;
    if (geometry != NO_HIT && geometry >= VIEW.feedback.first && place < VIEW.feedback.count)
        count_ray(place);
}

// Counts the boxes that a ray passes before it ends at `tmax`, cell by cell (as `grid.glsl`). One of FEEDBACK_RAYS
// invocations, in turns over frames, stands for all. `invocation`: its place in the launch.
void count_boxes(ivec2 invocation, vec3 origin, vec3 direction, float tmax) {
    if (HIT_FEEDBACK == 0) return;
    if ((uint(invocation.x) + 4 * uint(invocation.y)) % FEEDBACK_RAYS != VIEW.feedback.turn) return;
    ivec3 counts = ivec3(VIEW.feedback.counts[0], VIEW.feedback.counts[1], VIEW.feedback.counts[2]);
    if (counts.x == 0) return;
    vec3 low = VIEW.feedback.origin;
    float edge = VIEW.feedback.edge;
    // replaces zeros: zero times infinity is not a number
    vec3 d = mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
    vec3 inverse = 1.0 / d;
    vec3 base = (low - origin) * inverse, delta = edge * inverse;
    vec3 end = base + vec3(counts) * delta;
    vec3 near = min(base, end), far = max(base, end);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), min(far.z, tmax));
    if (!(enter <= leave)) return;
    ivec3 cell = clamp(ivec3(floor((origin + enter * d - low) / edge)), ivec3(0), counts - 1);
    bvec3 back = lessThan(inverse, vec3(0.0));
    ivec3 forth = mix(ivec3(1), ivec3(-1), back), ahead = mix(ivec3(1), ivec3(0), back);
    // each step moves a coordinate of the cell to a new value, so that the loop ends for rays that are not finite, too
    while (true) {
        uint place = uint((cell.z * counts.y + cell.y) * counts.x + cell.x);
        count_ray(VIEW.feedback.count + place);
        vec3 next = base + vec3(cell + ahead) * delta;
        float least = min(next.x, min(next.y, next.z));
        if (leave <= least) return;
        int axis = next.x == least ? 0 : (next.y == least ? 1 : 2);
        cell += mix(ivec3(0), forth, equal(ivec3(0, 1, 2), ivec3(axis)));
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, counts))) return;
    }
}

#endif
