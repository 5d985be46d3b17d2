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
#include "trace/specular_lights.glsl"
#include "trace/photons.glsl"

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
// or photons sample the lights that lie behind it. CHAIN_UNSAMPLED: at another mirror or at a portal; no pass samples lights
// there, so that their emission counts where the ray hits it. CHAIN_ROUGH: at a rough surface; samples of lights and rays
// share what rays can meet (multiple importance sampling, power heuristic; Veach, Robust Monte Carlo Methods, section
// 9.2.4), by the density of the ray, which the upper bits hold.
const uint CHAIN_NONE = 0, CHAIN_SAMPLED = 1, CHAIN_UNSAMPLED = 2, CHAIN_ROUGH = 3, CHAIN_BITS = 3;

uint rough_chain(float density) { return floatBitsToUint(density) & ~CHAIN_BITS | CHAIN_ROUGH; }
float chain_density(uint chain) { return uintBitsToFloat(chain & ~CHAIN_BITS); }

// The vertex of a path from which the next ray starts.
struct PathVertex {
    vec3 position;
    vec3 face_normal; // on the side that the path comes from
    vec3 normal; // diffuse vertices only
    uint chain; // CHAIN_*
    vec3 direction; // of the next ray; not of diffuse vertices
    Gloss gloss; // of rough vertices
    vec3 to_viewer; // of rough vertices: back along the path
};

PathVertex first_vertex(LightTask task) {
    return PathVertex(task.surface.position, task.surface.face_normal, task.surface.normal, CHAIN_NONE, vec3(0.0), NO_GLOSS, vec3(0.0));
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

// The same for `specular_light.rgen`.
float specular_random(LightTask task, uint path) {
    rng_begin(uvec2(task.pixel), subsample_index(task.seed), STREAM_SPECULAR + STREAM_PATH * path);
    return rng_independent();
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
// denoiser takes for light. Four times display white, of what the pixel shows.
const float MOST_LIVE_LIGHT = 4.0;

vec3 bounded_light(vec3 light, float most) {
    if ((VIEW.flags & VIEW_ACCUMULATE) != 0) return light;
    return light * min(most * exp2(-VIEW.exposure.base) / max(max_component(light), 1.0e-20), 1.0);
}

// Radiance of a surface as a light of the lists, as far as the ray counts it. `away`: its distance.
vec3 listed_radiance(SurfacePoint p, vec3 direction, float away, uint chain) {
    bool known = (p.triangle.flags & TRIANGLE_STATIC) != 0 && p.triangle.instance < VIEW.lights.emitted_count;
    if (!known) return vec3(0.0);
    EmittedLight light = EmittedLights(VIEW.lights.emitted).at[p.triangle.instance];
    vec3 radiance = light.radiance * VIEW.lights.scale;
    if ((chain & CHAIN_BITS) != CHAIN_ROUGH) return radiance;
    if (light.hittable == 0) return vec3(0.0);
    return radiance * ray_share(chain_density(chain), triangle_density(away, abs(dot(p.face_normal, direction)), triangle_area(p)));
}

// Radiance of the suns in a direction, as far as the ray counts it.
vec3 sun_radiance(vec3 direction, uint chain) {
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < VIEW.lights.sun_count; i++) {
        SunLight sun = SunLights(VIEW.lights.suns).at[i];
        if (!(sun.cos_angle < 1.0 && dot(direction, sun.direction) >= sun.cos_angle)) continue;
        float share = 1.0;
        if ((chain & CHAIN_BITS) == CHAIN_ROUGH) share = ray_share(chain_density(chain), sun_density(sun));
        sum += sun.irradiance * (VIEW.lights.scale * share / (2.0 * (1.0 - sun.cos_angle)));
    }
    return sum;
}

// Samples of lights among which a rough vertex selects: those that are bright to a diffuse surface often lie outside of the
// lobe.
const uint ROUGH_CANDIDATES = 4;

// A light sample of a rough vertex, selected in proportion to the light that the lobe reflects back along the path (resampled
// importance sampling). `both`: a ray sampled from the lobe follows, and counts its share.
LightSample rough_light(PathVertex v, bool both) {
    LightSet set = lights_at(v.position, v.face_normal, v.normal);
    LightSample selected = no_light();
    if (set_count(set) == 0) return selected;
    GlossView view = gloss_view(v.normal, v.to_viewer);
    float sum = 0.0, selected_target = 0.0;
    for (uint i = 0; i < ROUGH_CANDIDATES; i++) {
        vec2 u;
        LightChoice choice = one_choice(set, v.position, v.normal, u);
        if (!(choice.weight > 0.0)) continue;
        LightSample s = sample_light(choice.light, v.position, v.normal, u);
        if (!(max_component(s.light) > 0.0) || dot(s.direction, v.face_normal) <= 0.0) continue;
        float density = gloss_density(v.gloss, view, s.direction);
        // L of the sample has the cosine and pi
        s.light *= choice.weight * PI / max(dot(v.normal, s.direction), 1.0e-6);
        s.light *= gloss_weight(v.gloss, view, s.direction) * density;
        if (both) s.light *= 1.0 - ray_share_of(choice.light, v.position, s.direction, density);
        float target = luminance(s.light);
        if (!(target > 0.0)) continue;
        sum += target;
        if (rng_next() * sum >= target) continue;
        selected = s;
        selected_target = target;
    }
    if (selected_target > 0.0) selected.light *= sum / (selected_target * float(ROUGH_CANDIDATES));
    return selected;
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

// Smallest width of the distribution at the last vertex of a path, where no ray follows that could meet lights: a sharper
// lobe would find them in few, bright samples.
const float LEAST_LAST_ALPHA = 0.04;

// Decides whether a path goes on by the specular part of a rough surface, and divides its throughput by the probability.
bool chooses_gloss(vec3 lobe_albedo, vec3 lit, inout vec3 throughput) {
    float specular = max_component(throughput * lobe_albedo), diffuse = max_component(throughput * lit);
    float chance = specular / max(specular + diffuse, 1.0e-20);
    bool chosen = rng_next() < chance;
    throughput /= chosen ? max(chance, 1.0e-20) : 1.0 - chance;
    return chosen;
}

// Samples the next ray of a rough vertex; false: it leads into the surface.
bool rough_direction(inout PathVertex v, inout vec3 throughput) {
    GlossView view = gloss_view(v.normal, v.to_viewer);
    v.direction = gloss_direction(v.gloss, view, rng_next2());
    throughput *= gloss_weight(v.gloss, view, v.direction);
    v.chain = rough_chain(gloss_density(v.gloss, view, v.direction));
    v.position = offset_ray(v.position, v.face_normal);
    return dot(v.direction, v.face_normal) > 0.0 && max_component(throughput) > 0.0;
}

// Shades the hit of a bounce ray: adds emission to `sum`, and moves the vertex to the hit. `chain`: how the ray started.
// `most`: bound of what lamps and suns add. Returns whether the path goes on or takes a light sample at the vertex.
bool bounce_shade(Hit hit, vec3 origin, uint chain, float most, inout vec3 throughput, inout vec3 sum, out PathVertex v) {
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
    Material material = material_of(p.triangle.material);
    bool in_lists = (material.flags & MATERIAL_EMITTER) != 0, counts = (chain & CHAIN_BITS) >= CHAIN_UNSAMPLED;
    if (in_lists && counts) sum += bounded_light(throughput * listed_radiance(p, direction, t, chain), most);
    if (p.kind == KIND_SKY) {
        if (!in_lists) sum += throughput * sky_radiance(p, direction, BOUNCE_SPREAD, false, vec4(0.0));
        if (counts) sum += bounded_light(throughput * sun_radiance(direction, chain), most);
        return false;
    }
    Footprint seen = round_footprint(t * BOUNCE_SPREAD);
    Layer layer = evaluate_stages(p, seen);
    p.normal = mapped_normal(p, material, seen);
    vec3 lobe_albedo;
    Gloss gloss = take_gloss(p, material, seen, direction, layer.lit, lobe_albedo);
    if (!in_lists && p.kind != KIND_TRANSLUCENT) sum += throughput * max(layer.emission, 0.0);
    v.face_normal = dot(p.face_normal, direction) > 0.0 ? -p.face_normal : p.face_normal;
    v.normal = dot(p.normal, v.face_normal) < 0.0 ? -p.normal : p.normal;
    v.chain = CHAIN_NONE;
    v.to_viewer = -direction;
    v.gloss = NO_GLOSS;
    if (LAST_BOUNCE == 0 && chooses_mirror(p, direction, layer, throughput)) {
        bool sampled = is_sampled_mirror(p) || photons_mirror(p, direction);
        v.chain = chain == CHAIN_NONE && sampled ? CHAIN_SAMPLED : CHAIN_UNSAMPLED;
        mirror_ray(p, v.face_normal, v.normal, direction, v.position, v.direction);
        return true;
    }
    if (p.kind == KIND_TRANSLUCENT) return false;
    v.position = shading_position(p, v.face_normal);
    vec3 lit = clamp(layer.lit, 0.0, 1.0);
    if ((VIEW.flags & VIEW_ACCUMULATE) == 0) lit = min(lit + lobe_albedo, 1.0); // live frames have one lobe behind the first surface
    else if (is_glossy(gloss) && chooses_gloss(lobe_albedo, lit, throughput)) {
        v.chain = CHAIN_ROUGH;
        v.gloss = gloss;
        if (LAST_BOUNCE != 0) v.gloss.alpha = max(gloss.alpha, LEAST_LAST_ALPHA);
        return true;
    }
    throughput *= lit;
    return max_component(throughput) > 0.0;
}

// Samples the light of a diffuse vertex. One sample suffices: the bounce adds more noise than the selection.
LightSample vertex_light(PathVertex v) {
    return one_light(lights_at(v.position, v.face_normal, v.normal), v.position, v.normal);
}

// Start of the rays that leave the vertex.
vec3 vertex_origin(PathVertex v) { return v.chain == CHAIN_NONE ? offset_ray(v.position, v.face_normal) : v.position; }

#endif
