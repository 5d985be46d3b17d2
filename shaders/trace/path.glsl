// The path of a primary ray through a pixel: its accumulated radiance, and the lit point that the pixel shows.
#ifndef RELIGHT_TRACE_PATH_GLSL
#define RELIGHT_TRACE_PATH_GLSL
#include "trace/interface.glsl"
#include "trace/sky.glsl"
#include "trace/random.glsl"
#include "trace/gbuffer.glsl"
#include "trace/specular_surface.glsl"
#include "trace/camera.glsl"
#include "trace/motion.glsl"

// Most layers and surfaces of a path; the remaining transmittance stays black. Far above the depth of any scene: bounds
// the time of degenerate ones.
const uint MAX_EVENTS = 512;
// Displayed part of the background below which it is invisible in eight bits.
const float MIN_SHOWN = 1.0 / 1024.0;
// Lit layers at most this far from the surface behind them, units, share its light.
const float PAINT_DISTANCE = 0.5;
// First of the bits in `Path::solid_mask` that hold `PATHS_*`.
const uint PATHS_BIT = 8;
// Weakest reflection that is followed.
const float MIN_REFLECTION = 1.0 / 256.0;

struct Path {
    vec3 origin;
    vec3 direction;
    vec3 transmittance; // of mirrors and liquids; layers are in `cover`
    vec3 radiance;      // of surfaces without layers in front
    // Layers (fog included) and the surfaces behind them are summed as displayed (`layer.glsl`). `cover`: displayed
    // part of the background that the layers let through; `shown`: displayed sum; `glow`: emission in it, to be
    // multiplied by the sum's slope.
    vec3 cover;
    vec3 shown;
    vec3 glow;
    float weight;       // reciprocal of the probability of the branches taken
    float travelled;    // length of the previous segments
    LastSpace last;     // map of the path's points to the last frame
    vec3 view_direction; // direction of the path at the camera
    uint bent; // BENT_*: refracted, or mirrored by a curved surface: only the linear part of `last` is valid then
    vec3 absorption;    // of the liquid that contains the segment, per unit
    uint field;         // of the checkerboard: 1 refraction, 2 reflection; 0: the path was not split
    uint solid_mask; // mask of solid geometry; from bit PATHS_BIT on: the portals passed (PATHS_*), which rays ignore
    uint layer_mask;
    uint events;
};

// The lit point that the pixel shows. Of several lit layers along a path one is selected with a probability
// proportional to its contribution, and weighted by the reciprocal (reservoir sampling), so that the mean over frames
// is their sum.
GBufferPixel kept;
GlossPixel kept_gloss;
float kept_weight;
float weight_sum;
LastPlace kept_last;
uint kept_bent;
// Plane of the last lit surface, and whether that surface is selected. A decal shares the light of its surface, so both
// count as one, without a random selection between them.
vec4 lit_plane;
bool lit_kept;

// The solid surface at the end of the segment, or NO_HIT. Marks lie on it and use its displayed light.
Hit ahead;

// Displayed emission of the layers in front, and the motion of the brightest: its position in the last frame relative
// to this one, pixels; z negative: unknown.
vec3 glow_sum;
float brightest_glow;
vec3 glow_motion;
// Emission below this part of display white has no motion of its own.
const float MIN_GLOW = 1.0 / 256.0;

// Map of a point of the path to the last frame. A distorted point is taken to rest at its current virtual position.
LastSpace last_space(Path path, vec3 position, float t) {
    if (path.bent == BENT_NOT) return path.last;
    return LastSpace(path.last.linear, VIEW.camera.origin + path.view_direction * (path.travelled + t) - path.last.linear * position);
}

// Contribution of a surface to a path: its parts in linear light; the displayed part of the background that it
// transmits (`cover`); and the emission of lights and added light of models, shown by the texture (`own`).
struct SeenLayer {
    Layer linear;
    vec3 cover;
    vec3 own;
    float clear; // part of its light that fog leaves
    Gloss gloss;
    vec3 lobe_albedo; // specular albedo
};

// `last`: the point's position in the last frame; `lit`, `lobe_albedo`: factors of the diffuse and of the specular light.
void keep_lit(SurfacePoint p, vec3 lit, vec3 lobe_albedo, SeenLayer layer, Path path, LastPlace last, float t) {
    float weight = max_component(lit + lobe_albedo);
    if (!(weight > 0.0)) return;
    if (abs(dot(lit_plane.xyz, p.face_normal)) > 0.99 && abs(dot(lit_plane.xyz, p.position) - lit_plane.w) < PAINT_DISTANCE) {
        if (!lit_kept) return;
        kept.albedo += lit;
        if (is_glossy(layer.gloss)) kept_gloss = GlossPixel(layer.gloss, kept_gloss.lobe_albedo + lobe_albedo, -path.direction, 0.0);
        return;
    }
    lit_plane = vec4(p.face_normal, dot(p.face_normal, p.position));
    lit_kept = false;
    weight_sum += weight;
    if (weight_sum > weight && rng_next() * weight_sum >= weight) return;
    lit_kept = true;
    kept_weight = weight;
    kept.view_distance = path.travelled + t;
    bool turned = dot(p.face_normal, path.direction) > 0.0;
    kept.face_normal = turned ? -p.face_normal : p.face_normal;
    kept.position = shading_position(p, kept.face_normal);
    // the side that the path hits is lit
    kept.normal = dot(p.normal, kept.face_normal) < 0.0 ? -p.normal : p.normal;
    kept.albedo = lit;
    kept_gloss = GlossPixel(layer.gloss, lobe_albedo, -path.direction, 0.0);
    kept.first_person = (instance_of(p.instance).flags & INSTANCE_FIRST_PERSON) != 0;
    kept_last = last;
    kept_bent = path.bent;
}

// Records emission in front of the surface that sets the pixel's motion. Only temporal antialiasing reads it.
void record_glow(Path path, vec3 emission, LastPlace last) {
    if (VIEW.antialias.history == 0 || emission == vec3(0.0)) return;
    vec3 glow = path.cover * encode_display(path.transmittance * emission);
    float brightest = max_component(glow);
    if (!(brightest > MIN_GLOW)) return;
    glow_sum += glow;
    if (brightest <= brightest_glow) return;
    brightest_glow = brightest;
    CameraRay ray = CameraRay(path.origin, path.direction, path.view_direction, 0.0, vec2(LAUNCH_PIXEL) + vec2(0.5) + VIEW.antialias.jitter);
    glow_motion = motion_of(ray, last).xyz;
}

// Part of the pixel's light, relative to its emission (`front`), that is due to layers which move differently from the
// surface. Their display also increases the weight of light behind them. The pixel's history follows the surface and
// does not include them.
float moved_glow(vec4 motion, vec3 front, vec3 shown) {
    if (glow_sum == vec3(0.0)) return 0.0;
    vec3 without = max(shown - glow_sum, 0.0);
    vec3 added = shown == vec3(0.0) ? front : shown * display_slope(shown) - without * display_slope(without);
    // pixels
    const float AT_REST = 0.25, AWAY = 1.0;
    float away = glow_motion.z < 0.0 || motion.z < 0.0 ? 1.0 : smoothstep(AT_REST, AWAY, distance(glow_motion.xy, motion.xy));
    return away * clamp(max_component(added) / max(MOST_FRESH * max_component(front), 1.0e-6), 0.0, 0.99);
}

// `mirrors`: whether rays follow the reflection; otherwise environment images replace it. `clear`: displayed part of
// the layer that fog leaves.
SeenLayer seen_layer(SurfacePoint p, Material material, Footprint seen, vec3 direction, bool mirrors, float clear) {
    Layer shown = run_stages(material, p, seen, mirrors ? SEEN_FOLLOWED : SEEN_LAST);
    if (clear < 1.0) {
        shown.lit *= clear;
        shown.emission *= clear;
        shown.haze *= clear;
        shown.reflected *= clear;
        shown.through = mix(vec3(1.0), shown.through, clear);
    }
    Layer part = Layer(bounded_albedo(material, linear_part(shown.lit)), vec3(0.0), linear_part(shown.through), linear_part(shown.reflected), vec3(0.0));
    // a map's glow adds to light, not to displayed values as stages do
    vec3 own = part.lit * (shown_glow(material) + added_light(p)) + glow_map(p, material, seen) * clear;
    take_mirror(material, part);
    vec3 lobe_albedo;
    Gloss gloss = take_gloss(p, material, seen, direction, part.lit, lobe_albedo);
    if (max_component(part.reflected) < MIN_REFLECTION) part.reflected = vec3(0.0);
    part.emission = linear_part(shown.emission + shown.haze);
    return SeenLayer(part, max(shown.through, 0.0), own, linear_part(vec3(clear)).x, gloss, lobe_albedo);
}

// Bound of the gain of traced light on layers where the engine shows hardly any light: their share of the displayed sum
// would amplify it beyond what a display shows.
const float MOST_GAIN = 4.0;

// Adds a displayed value behind the layers in front. Returns the factor of its light, which the slope of the whole sum
// multiplies at the end.
vec3 share_display(inout Path path, vec3 own) {
    path.shown += path.cover * own;
    return path.cover / display_slope(own);
}

// Adds emission that hides everything behind it: the sky.
void add_glow(inout Path path, vec3 radiance) {
    vec3 glow = path.transmittance * radiance;
    if (path.cover == vec3(1.0) && path.shown == vec3(0.0)) path.radiance += path.weight * glow;
    else path.glow += path.weight * glow * share_display(path, encode_display(glow));
}

// Light that the engine shows at a layer, linear.
vec3 light_shown(SurfacePoint p) {
    bool mark = (p.triangle.flags & TRIANGLE_WORLD) == 0 && (material_of(p.triangle.material).flags & MATERIAL_POLYGON_OFFSET) != 0;
    if (mark && ahead.geometry != NO_HIT) {
        SurfacePoint wall = surface_point(ahead);
        if (wall.kind != KIND_SKY) p = wall;
    }
    return decode_display(displayed_light(p));
}

void add_layer(inout Path path, SurfacePoint p, SeenLayer layer, LastPlace last, float t) {
    vec3 lit = path.transmittance * layer.linear.lit, own = path.transmittance * layer.own;
    vec3 glow = path.transmittance * layer.linear.emission, lobe_albedo = path.transmittance * layer.lobe_albedo;
    bool glows = glow != vec3(0.0), is_lit = lit + lobe_albedo != vec3(0.0);
    bool alone = path.cover == vec3(1.0) && path.shown == vec3(0.0) && layer.cover == vec3(0.0) && !(glows && is_lit);
    vec3 gain = vec3(1.0);
    if (alone) {
        path.radiance += path.weight * (glow + own);
    } else {
        if (glows) path.glow += path.weight * glow * share_display(path, encode_display(glow));
        if (is_lit) {
            vec3 share = share_display(path, encode_display((lit + lobe_albedo) * light_shown(p) + own));
            path.glow += path.weight * own * share;
            gain = min(share, path.cover * MOST_GAIN / display_slope(path.shown));
        }
    }
    keep_lit(p, path.weight * lit * gain, path.weight * lobe_albedo * gain, layer, path, last, t);
    path.cover *= layer.cover;
    path.events++;
}

bool is_over(Path path) {
    // the root of light is close to its displayed value
    return rays_needed || max_component(path.cover * sqrt(path.transmittance)) < MIN_SHOWN || path.events >= MAX_EVENTS;
}

// The area of the surface that the pixel's cone covers.
Footprint footprint(Path path, SurfacePoint p, float t) {
    float cosine = max(abs(dot(p.face_normal, path.direction)), 0.05);
    float width = (path.travelled + t) * VIEW.camera.pixel_spread * VIEW.antialias.texture_scale;
    if (VIEW.antialias.anisotropy > 1.0) return ellipse_footprint(p, path.direction, cosine, width);
    return round_footprint(width * inversesqrt(cosine));
}

#endif
