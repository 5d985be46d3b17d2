// Bounced light: paths of cosine-weighted and mirrored bounces with a light sample at every diffuse vertex but the first,
// whose direct light `direct.rgen` computes. With a cosine-weighted density cosine and pi cancel in the estimator of L,
// so that a diffuse vertex multiplies the throughput by its albedo alone.
#ifndef RELIGHT_TRACE_BOUNCE_GLSL
#define RELIGHT_TRACE_BOUNCE_GLSL

#include "trace/lights.glsl"
#include "trace/layer.glsl"
#include "trace/sky.glsl"
#include "trace/fog.glsl"
#include "trace/subsample.glsl"
#include "trace/mirrors.glsl"

// 1: the map has fog. 0 removes the code of fog.
layout(constant_id = 1) const uint HAS_FOG = 0;

// 1: no bounce follows, so that no ray has to go on mirrored.
layout(constant_id = 2) const uint LAST_BOUNCE = 0;

// Mask of bounce rays.
const uint MASK_BOUNCE = MASK_SOLID | MASK_THIRD_SOLID | MASK_SKY | MASK_NO_SHADOW;

// Mask of the first ray of a path; see `shadow_mask`.
uint first_bounce_mask(bool first_person) { return first_person ? MASK_BOUNCE & ~MASK_THIRD_SOLID : MASK_BOUNCE; }
// Spread of the cones of bounce rays.
const float BOUNCE_SPREAD = 0.1;

// How a ray of a path starts, which decides who samples the lights that it meets. CHAIN_NONE: at a diffuse vertex, where
// `one_light` samples them. CHAIN_SAMPLED: at a flat mirror that a ray from a diffuse vertex has met; `mirror_light.rgen`
// samples the lights that lie behind it. CHAIN_UNSAMPLED: at another mirror or at a portal; no pass samples lights
// there, so that their emission counts where the ray hits it.
const uint CHAIN_NONE = 0, CHAIN_SAMPLED = 1, CHAIN_UNSAMPLED = 2;

// The vertex of a path from which the next ray starts.
struct PathVertex {
    vec3 position;
    vec3 face_normal; // on the side that the path comes from
    vec3 normal; // diffuse vertices only
    uint chain; // CHAIN_*
    vec3 direction; // of the next ray; mirrored vertices only
};

// Whether a pixel gathers bounced light.
bool gathers(LightTask task) { return task.surface.view_distance >= 0.0 && (VIEW.flags & VIEW_FULLBRIGHT) == 0; }

PathVertex first_vertex(LightTask task) {
    return PathVertex(task.surface.position, task.surface.face_normal, task.surface.normal, CHAIN_NONE, vec3(0.0));
}

// Passes of a bounce: its rays, the surfaces that they meet, the rays to lights.
const uint BOUNCE_RAYS = 0, BOUNCE_HITS = 1, BOUNCE_LIGHT = 2;

// Starts the random numbers of one of these passes for a pixel and path (`path`); returns one for rounding.
float bounce_random(LightTask task, uint bounce, uint pass, uint path) {
    uint stream = STREAM_BOUNCE + STREAMS * (3 * bounce + pass) + STREAM_PATH * path;
    rng_begin(uvec2(task.pixel), subsample_index(task.seed), stream);
    return rng_independent();
}

// The same for `mirror_light.rgen`, in streams of their own.
float mirror_random(LightTask task, uint bounce, uint path) {
    rng_begin(uvec2(task.pixel), subsample_index(task.seed), STREAM_MIRRORS + STREAMS * bounce + STREAM_PATH * path);
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
    direction = v.direction;
    if (v.chain != CHAIN_NONE) return true;
    direction = sample_cosine(v.normal, rng_next2());
    return dot(direction, v.face_normal) > 0.0;
}

// Whether light can come from the hit side. A culled side closes the world: what lies behind it (the outside of the
// map, the inside of a model) emits no light.
bool shows_face(SurfacePoint p, vec3 direction) {
    return p.kind == KIND_SKY || !is_culled(p, direction);
}

// Bounds the light of lamps and suns that paths meet by chance, in live frames: it comes in few, bright samples, which a
// denoiser takes for light. Four times display white.
const float MOST_LIVE_LIGHT = 4.0;

vec3 bounded_light(vec3 light) {
    if ((VIEW.flags & VIEW_ACCUMULATE) != 0) return light;
    return light * min(MOST_LIVE_LIGHT * exp2(-VIEW.exposure.base) / max(max_component(light), 1.0e-20), 1.0);
}

// Radiance of a surface as a light of the lists.
vec3 listed_radiance(SurfacePoint p) {
    bool known = (p.triangle.flags & TRIANGLE_STATIC) != 0 && p.triangle.instance < VIEW.lights.emitted_count;
    return known ? Positions(VIEW.lights.emitted).at[p.triangle.instance] * VIEW.lights.scale : vec3(0.0);
}

// Radiance of the suns in a direction.
vec3 sun_radiance(vec3 direction) {
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < VIEW.lights.sun_count; i++) {
        SunLight sun = SunLights(VIEW.lights.suns).at[i];
        if (sun.cos_angle < 1.0 && dot(direction, sun.direction) >= sun.cos_angle)
            sum += sun.irradiance * (VIEW.lights.scale / (2.0 * (1.0 - sun.cos_angle)));
    }
    return sum;
}

// Decides whether a path goes on mirrored, by the brightest channel of both parts, and divides its throughput by the
// probability of the choice; of a mirrored one multiplies it.
bool chooses_mirror(SurfacePoint p, vec3 direction, Layer layer, inout vec3 throughput) {
    vec3 mirrored = mirrored_part(p, direction, layer);
    if (p.kind == KIND_TRANSLUCENT) {
        // `bounce_rays.rgen` has chosen the layer with this probability
        throughput *= mirrored / layer_reflectance(p, direction);
        return true;
    }
    float weight = max_component(throughput * mirrored);
    if (!(max_component(mirrored) >= MIN_MIRRORED && weight > 0.0)) return false;
    float chance = weight / (weight + max_component(throughput * clamp(layer.lit, 0.0, 1.0)));
    bool chosen = rng_next() < chance;
    throughput *= chosen ? mirrored / chance : vec3(1.0 / (1.0 - chance));
    return chosen;
}

// Shades the hit of a bounce ray: adds emission to `sum`, and moves the vertex to the hit. `chain`: how the ray started.
// Returns whether the path goes on or takes a light sample at the vertex.
bool bounce_shade(Hit hit, vec3 origin, uint chain, inout vec3 throughput, inout vec3 sum, out PathVertex v) {
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
    // passes that sample the lists have counted their lights
    bool in_lists = (material_of(p.triangle.material).flags & MATERIAL_EMITTER) != 0;
    if (in_lists && chain == CHAIN_UNSAMPLED) sum += bounded_light(throughput * listed_radiance(p));
    if (p.kind == KIND_SKY) {
        if (!in_lists) sum += throughput * sky_radiance(p, direction, BOUNCE_SPREAD, false, vec4(0.0));
        if (chain == CHAIN_UNSAMPLED) sum += bounded_light(throughput * sun_radiance(direction));
        return false;
    }
    Layer layer = evaluate_stages(p, round_footprint(t * BOUNCE_SPREAD));
    if (!in_lists && p.kind != KIND_TRANSLUCENT) sum += throughput * max(layer.emission, 0.0);
    v.face_normal = dot(p.face_normal, direction) > 0.0 ? -p.face_normal : p.face_normal;
    v.normal = dot(p.normal, v.face_normal) < 0.0 ? -p.normal : p.normal;
    v.chain = CHAIN_NONE;
    if (LAST_BOUNCE == 0 && chooses_mirror(p, direction, layer, throughput)) {
        v.chain = chain == CHAIN_NONE && is_sampled_mirror(p) ? CHAIN_SAMPLED : CHAIN_UNSAMPLED;
        mirror_ray(p, v.face_normal, v.normal, direction, v.position, v.direction);
        return true;
    }
    if (p.kind == KIND_TRANSLUCENT) return false;
    throughput *= clamp(layer.lit, 0.0, 1.0);
    v.position = shading_position(p, v.face_normal);
    return max_component(throughput) > 0.0;
}

// Samples the light of a diffuse vertex. One sample suffices: the bounce adds more noise than the selection.
LightSample vertex_light(PathVertex v) {
    return one_light(lights_at(v.position, v.face_normal, v.normal), v.position, v.normal);
}

// Start of the rays that leave the vertex.
vec3 vertex_origin(PathVertex v) { return v.chain == CHAIN_NONE ? offset_ray(v.position, v.face_normal) : v.position; }

#endif
