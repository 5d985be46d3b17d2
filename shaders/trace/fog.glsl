// Fog volumes along a ray. Inside a volume's box and below its surface the engine's factor is sqrt(length / depth),
// opaque at `depth`; here the length is that of the ray's own way through the volume. The factor weighs linear light.
#ifndef RELIGHT_TRACE_FOG_GLSL
#define RELIGHT_TRACE_FOG_GLSL

#include "trace/boxes.glsl"
#include "trace/color.glsl"
#include "trace/geometry.glsl"
#include "trace/fog_keep.glsl"

// Where the ray is inside the volume: x < y, or an empty range. `inverse`: of the direction.
vec2 fog_range(Fog fog, vec3 origin, vec3 direction, vec3 inverse) {
    vec2 range = box_range(fog.mins, fog.maxs, origin, inverse, FAR);
    float enter = range.x, leave = range.y;
    if (fog.has_surface != 0) {
        float below = dot(fog.plane.xyz, origin) - fog.plane.w;
        float rate = dot(fog.plane.xyz, direction);
        if (abs(rate) < 1.0e-12) {
            if (below < 0.0) return vec2(1.0, 0.0);
        } else if (rate > 0.0) {
            enter = max(enter, -below / rate);
        } else {
            leave = min(leave, -below / rate);
        }
    }
    return vec2(enter, leave);
}

float fog_transmittance(Fog fog, vec2 range, float t) {
    float inside = clamp(min(t, range.y) - range.x, 0.0, FAR);
    return 1.0 - sqrt(min(inside / max(fog.depth, 1.0), 1.0));
}

// Composes the fog between two distances on a ray behind what is in front (`transmittance`, `radiance`). Volumes do not
// overlap, so each is taken whole, nearest first. The fog's colour stands for light that was scattered often; what comes
// straight from lights is found at the points that are kept. `travelled`: length of the path before the ray.
void fog_segment(vec3 origin, vec3 direction, float from, float to, float travelled, inout vec3 transmittance, inout vec3 radiance) {
    uint count = VIEW.fog_count;
    float last_enter = -1.0;
    uint last_index = 0;
    vec3 inverse = inverse_direction(direction);
    TraceFogs fogs = TraceFogs(VIEW.fogs);
    for (uint step_index = 0; step_index < count; step_index++) {
        // the next volume by entry, then by index
        vec2 best = vec2(FAR);
        uint chosen = count;
        for (uint i = 0; i < count; i++) {
            vec2 range = fog_range(fogs.at[i], origin, direction, inverse);
            if (range.x >= range.y || range.x >= to || range.y <= from) continue;
            bool later = range.x > last_enter || (range.x == last_enter && i > last_index);
            if (later && range.x < best.x) { best = range; chosen = i; }
        }
        if (chosen == count) return;
        Fog fog = fogs.at[chosen];
        float before = fog_transmittance(fog, best, from);
        float ratio = before > 0.0 ? clamp(fog_transmittance(fog, best, to) / before, 0.0, 1.0) : 0.0;
        vec3 scattered = transmittance * decode_display(fog.color) * (1.0 - ratio);
        radiance += scattered;
        if (LIT_FOG != 0) {
            float depth = max(fog.depth, 1.0);
            vec2 place = clamp((min(vec2(from, to), best.y) - best.x) / depth, 0.0, 1.0);
            fog_keep(scattered, depth, place, best.x, origin, direction, travelled);
        }
        transmittance *= ratio;
        last_enter = best.x;
        last_index = chosen;
    }
}

#endif
