// Fog volumes. For primary rays fog follows the engine: it covers the surfaces that the map assigns to it, by their
// view depth, and never a sky. Rays of bounced light intersect the volumes themselves: inside a volume's box and below
// its surface the fog's share is sqrt(length / depth).
#ifndef RELIGHT_TRACE_FOG_GLSL
#define RELIGHT_TRACE_FOG_GLSL

#include "common/fog.glsl"
#include "trace/boxes.glsl"
#include "trace/color.glsl"
#include "trace/geometry.glsl"

// Range of the ray inside the volume: x < y, or empty. `inverse`: of the direction.
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

// The engine's fog factor (`R_FogFactor`), 0 to 1: the fog's share of the displayed colour. `depth`: view depth of the
// point, units; `part`: fraction of the segment from the camera to it that lies below the fog's surface.
float fog_cover(Fog fog, float depth, float part) {
    return sqrt(clamp(depth * part / max(fog.depth, 1.0), 0.0, 1.0));
}

// `part` of `fog_cover` for a point on a triangle: computed at the corners, as in the engine, and interpolated. `camera`:
// camera position unfolded through the mirrors and portals of the path.
float fog_part(Fog fog, SurfacePoint p, vec3 camera) {
    if (fog.has_surface == 0) return 1.0;
    float camera_below = dot(fog.plane.xyz, camera) - fog.plane.w;
    Instance instance = instance_of(p.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
    float part = 0.0;
    for (int i = 0; i < 3; i++) {
        vec3 corner = axis * TraceVertices(p.vertices).at[p.triangle.indices[i]].position + instance.origin;
        part += p.weights[i] * fog_share(dot(fog.plane.xyz, corner) - fog.plane.w, camera_below);
    }
    return part;
}

// Composites the fog along a ray of bounced light, up to the distance `to`, behind what is in front (`transmittance`,
// `radiance`): each volume by itself, in linear light. Volumes do not overlap, so each is taken whole, nearest first.
void fog_in_light(vec3 origin, vec3 direction, float to, inout vec3 transmittance, inout vec3 radiance) {
    vec3 inverse = inverse_direction(direction);
    uint count = VIEW.scene.fog_count, last = 0;
    float entered = -1.0;
    TraceFogs fogs = TraceFogs(VIEW.scene.fogs);
    for (uint turn = 0; turn < count; turn++) {
        vec2 best = vec2(FAR);
        uint nearest = count;
        for (uint i = 0; i < count; i++) {
            vec2 range = fog_range(fogs.at[i], origin, direction, inverse);
            if (range.x >= range.y || range.x >= to) continue;
            bool later = range.x > entered || (range.x == entered && i > last);
            if (later && range.x < best.x) { best = range; nearest = i; }
        }
        if (nearest == count) return;
        float cover = fog_cover(fogs.at[nearest], min(to, best.y) - best.x, 1.0);
        radiance += transmittance * decode_display(fogs.at[nearest].color) * cover;
        transmittance *= 1.0 - cover;
        entered = best.x;
        last = nearest;
    }
}

#endif
