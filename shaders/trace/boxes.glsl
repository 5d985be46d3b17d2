// Intersection of rays and boxes by slabs (Kay and Kajiya, Ray Tracing Complex Scenes, SIGGRAPH 1986).
#ifndef RELIGHT_TRACE_BOXES_GLSL
#define RELIGHT_TRACE_BOXES_GLSL

#include "trace/view.glsl"

// Reciprocal of a direction. Replaces zeros, because zero times infinity is not a number.
vec3 inverse_direction(vec3 direction) {
    return 1.0 / mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
}

// Range of the ray inside a box; empty if x > y. `farthest`: end of the ray.
vec2 box_range(vec3 mins, vec3 maxs, vec3 origin, vec3 inverse, float farthest) {
    vec3 a = (mins - origin) * inverse, b = (maxs - origin) * inverse;
    vec3 near = min(a, b), far = max(a, b);
    return vec2(max(max(near.x, near.y), max(near.z, 0.0)), min(min(far.x, far.y), min(far.z, farthest)));
}

// Whether a ray hits one of the boxes (smallest and largest corners) before `farthest`.
bool meets_box(Boxes boxes, uint count, vec3 origin, vec3 direction, float farthest) {
    vec3 inverse = inverse_direction(direction);
    for (uint i = 0; i < count; i++) {
        vec2 range = box_range(boxes.at[2 * i], boxes.at[2 * i + 1], origin, inverse, farthest);
        if (range.x <= range.y) return true;
    }
    return false;
}

#endif
