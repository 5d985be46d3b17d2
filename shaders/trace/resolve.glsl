// Shared by the passes that resolve the picture over frames: compressed colours, and whether a pixel has a history.
#ifndef RELIGHT_TRACE_RESOLVE_GLSL
#define RELIGHT_TRACE_RESOLVE_GLSL

#include "trace/denoise.glsl"
#include "trace/exposure.glsl"
#include "trace/motion.glsl"

// A neighbour is in front if its view distance is below this fraction of the pixel's.
const float IN_FRONT = 0.9;
// Relative tolerance of view distances of the same surface.
const float SAME_DISTANCE = 0.04;

// Nearly linear up to white, so that edges converge to the mean of both sides; bounded by four times white.
vec3 compress(vec3 c, float exposure) { return c / (1.0 + max_component(c) * exposure); }
vec3 expand(vec3 c, float exposure) { return c / max(1.0 - max_component(c) * exposure, 1.0e-3); }
const float COMPRESSION = 0.25;

vec3 to_ycocg(vec3 c) { return vec3(0.25 * c.r + 0.5 * c.g + 0.25 * c.b, 0.5 * (c.r - c.b), 0.5 * c.g - 0.25 * (c.r + c.b)); }
vec3 from_ycocg(vec3 c) { return vec3(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z); }

// Factor of radiance in `compress`.
float compression() {
    return COMPRESSION * max(ExposureState(VIEW.exposure.state).exposure, 1.0e-3) * exp2(VIEW.exposure.base + VIEW.exposure.bias);
}

// Whether the traced pixel at `place`, or the range of the pixels around it, had this view distance in the last frame.
// A range, because a floor at a grazing angle has many distances. The pixels around count, because the samples of an
// edge pixel hit one side in one frame and the other side in the next. In the checkerboard of reflection and refraction
// (`takes_turns`) diagonal and direct neighbours show different surfaces, and either may match. At rest, a surface too
// thin to be hit in every frame counts as seen unless something around it has moved away since.
bool was_seen(vec2 place, float view_distance, bool rests, bool takes_turns) {
    const vec2 around[8] = vec2[](vec2(1, 1), vec2(-1, 1), vec2(1, -1), vec2(-1, -1), vec2(1, 0), vec2(-1, 0), vec2(0, 1), vec2(0, -1));
    ivec2 last = ivec2(VIEW.width, VIEW.height) - 1;
    float slack = SAME_DISTANCE * view_distance + 1.0;
    if (abs(abs(last_view_distance_read(clamp(ivec2(floor(place)), ivec2(0), last))) - view_distance) < slack) return true;
    float least = 1.0e30, most = 0.0;
    bool rested = rests;
    for (int i = 0; i < (rests || takes_turns ? 8 : 4); i++) {
        float then = last_view_distance_read(clamp(ivec2(floor(place + 0.99 * around[i])), ivec2(0), last));
        rested = rested && then >= 0.0;
        least = min(least, abs(then));
        most = max(most, abs(then));
    }
    return rested || view_distance > least - slack && view_distance < most + slack;
}

#endif
