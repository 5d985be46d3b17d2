// Bounced light: paths of cosine-weighted bounces with a light sample at every vertex but the first, whose direct light
// `direct.rgen` computes. With this density cosine and pi cancel in the estimator of L, so that a vertex multiplies the
// throughput by its albedo alone.
#ifndef RELIGHT_TRACE_BOUNCE_GLSL
#define RELIGHT_TRACE_BOUNCE_GLSL

#include "trace/lights.glsl"
#include "trace/layer.glsl"
#include "trace/sky.glsl"
#include "trace/fog.glsl"
#include "trace/subsample.glsl"

// 1: the map has fog. 0 removes the code of fog.
layout(constant_id = 1) const uint HAS_FOG = 0;

// Mask of bounce rays.
const uint MASK_BOUNCE = MASK_SOLID | MASK_THIRD_SOLID | MASK_SKY | MASK_NO_SHADOW;

// Mask of the first ray of a path; see `shadow_mask`.
uint first_bounce_mask(bool first_person) { return first_person ? MASK_BOUNCE & ~MASK_THIRD_SOLID : MASK_BOUNCE; }
// Spread of the cones of bounce rays.
const float BOUNCE_SPREAD = 0.1;

// The vertex of a path from which the next ray starts.
struct PathVertex {
    vec3 position;
    vec3 face_normal; // on the side that the path comes from
    vec3 normal;
};

// Whether a pixel gathers bounced light.
bool gathers(LightTask task) { return task.surface.view_distance >= 0.0 && (VIEW.flags & VIEW_FULLBRIGHT) == 0; }

PathVertex first_vertex(LightTask task) {
    return PathVertex(task.surface.position, task.surface.face_normal, task.surface.normal);
}

// Passes of a bounce: its rays, the surfaces that they meet, the rays to lights.
const uint BOUNCE_RAYS = 0, BOUNCE_HITS = 1, BOUNCE_LIGHT = 2;

// Starts the random numbers of one of these passes for a pixel; returns one for rounding.
float bounce_random(LightTask task, uint bounce, uint pass) {
    rng_begin(uvec2(task.pixel), subsample_index(task.seed), STREAM_BOUNCE + STREAMS * (3 * bounce + pass));
    return rng_independent();
}

// A cosine-weighted direction about n. With this density the estimator of L is the radiance along the ray.
vec3 sample_cosine(vec3 n, vec2 u) {
    vec3 t, b;
    basis(n, t, b);
    float r = sqrt(u.x), phi = 2.0 * PI * u.y;
    return normalize(t * (r * cos(phi)) + b * (r * sin(phi)) + n * sqrt(max(1.0 - u.x, 0.0)));
}

// Samples the direction of the next ray. False: it points into the surface, which an interpolated normal permits; no
// light comes from there.
bool bounce_direction(PathVertex v, out vec3 direction) {
    direction = sample_cosine(v.normal, rng_next2());
    return dot(direction, v.face_normal) > 0.0;
}

// Whether light can come from the hit side. A culled side closes the world: what lies behind it (the outside of the
// map, the inside of a model) emits no light.
bool shows_face(SurfacePoint p, vec3 direction) {
    return p.kind == KIND_SKY || !is_culled(p, direction);
}

// Shades the hit of a bounce ray: adds emission to `sum` and moves the vertex to the hit. False: the path ends.
bool bounce_shade(Hit hit, vec3 origin, inout vec3 throughput, inout vec3 sum, out PathVertex v) {
    SurfacePoint p = surface_point(hit);
    vec3 direction = safe_normalize(p.position - origin, -p.face_normal);
    float t = dot(p.position - origin, direction);
    if (HAS_FOG != 0) {
        // displayed colour, exposed as the engine shows it, as for primary rays
        vec3 fog = vec3(0.0);
        fog_in_light(origin, direction, t, throughput, fog);
        sum += fog * exp2(-VIEW.exposure.base);
    }
    if (!shows_face(p, direction)) return false;
    // Emitters in the light lists are sampled by `one_light`; their emission must not count twice.
    bool in_lists = (material_of(p.triangle.material).flags & MATERIAL_EMITTER) != 0;
    if (p.kind == KIND_SKY) {
        if (!in_lists) sum += throughput * sky_radiance(p, direction, BOUNCE_SPREAD, false, vec4(0.0));
        return false;
    }
    Layer layer = evaluate_stages(p, round_footprint(t * BOUNCE_SPREAD));
    if (!in_lists) sum += throughput * max(layer.emission, 0.0);
    throughput *= clamp(layer.lit, 0.0, 1.0);
    v.face_normal = dot(p.face_normal, direction) > 0.0 ? -p.face_normal : p.face_normal;
    v.position = shading_position(p, v.face_normal);
    v.normal = dot(p.normal, v.face_normal) < 0.0 ? -p.normal : p.normal;
    return max_component(throughput) > 0.0;
}

// Samples the light of a vertex. One sample suffices: the bounce adds more noise than the selection.
LightSample vertex_light(PathVertex v) { return one_light(v.position, v.face_normal, v.normal); }

#endif
