// Fog volumes along a ray. Inside a volume's box and below its surface the engine's factor is sqrt(length / depth),
// opaque at `depth`; here the length is that of the ray's own way through the volume.
#ifndef RELIGHT_TRACE_FOG_GLSL
#define RELIGHT_TRACE_FOG_GLSL

#include "trace/boxes.glsl"
#include "trace/color.glsl"
#include "trace/geometry.glsl"

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

// What a piece of a ray has of one volume. The fog's colour stands for all light that its author saw there; the part of it that
// comes straight from lights is found at the points that are kept (fog_keep.glsl).
struct FogPiece {
    vec3 color;  // displayed
    float ratio; // of what lies behind, what is left
    float depth; // at which the fog is opaque, units
    vec2 place;  // where on the ray's way through the volume the piece begins and ends, as parts of the depth
    float enter; // where that way begins
    vec3 own_light; // radiance at places in the volume in the mean, of the map's lights
};

// The volume whose piece was the last one.
struct FogOrder {
    float enter;
    uint index;
};

FogOrder fog_begin() { return FogOrder(-1.0, 0u); }

// The next piece between two distances on a ray; false: there is none. Volumes do not overlap, so each is taken whole,
// nearest first.
bool fog_next(vec3 origin, vec3 direction, vec3 inverse, float from, float to, inout FogOrder order, out FogPiece piece) {
    uint count = VIEW.fog_count;
    TraceFogs fogs = TraceFogs(VIEW.fogs);
    vec2 best = vec2(FAR);
    uint chosen = count;
    for (uint i = 0; i < count; i++) {
        vec2 range = fog_range(fogs.at[i], origin, direction, inverse);
        if (range.x >= range.y || range.x >= to || range.y <= from) continue;
        bool later = range.x > order.enter || (range.x == order.enter && i > order.index);
        if (later && range.x < best.x) { best = range; chosen = i; }
    }
    if (chosen == count) return false;
    Fog fog = fogs.at[chosen];
    float before = fog_transmittance(fog, best, from);
    piece.color = fog.color;
    piece.ratio = before > 0.0 ? clamp(fog_transmittance(fog, best, to) / before, 0.0, 1.0) : 0.0;
    piece.depth = max(fog.depth, 1.0);
    piece.place = clamp((min(vec2(from, to), best.y) - best.x) / piece.depth, 0.0, 1.0);
    piece.enter = best.x;
    piece.own_light = fog.own_light;
    order = FogOrder(best.x, chosen);
    return true;
}

// Composes the fog before a distance on a ray of bounced light behind what is in front (`transmittance`, `radiance`): each
// part by itself, in light. What the eye sees of fog is mixed as it is displayed (primary.rgen).
void fog_in_light(vec3 origin, vec3 direction, float to, inout vec3 transmittance, inout vec3 radiance) {
    vec3 inverse = inverse_direction(direction);
    FogOrder order = fog_begin();
    FogPiece piece;
    for (uint i = 0; i < VIEW.fog_count && fog_next(origin, direction, inverse, 0.0, to, order, piece); i++) {
        radiance += transmittance * decode_display(piece.color) * (1.0 - piece.ratio);
        transmittance *= piece.ratio;
    }
}

#endif
