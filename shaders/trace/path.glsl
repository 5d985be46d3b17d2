// The eye's path through a pixel: what it has gathered of what it passed, and the point whose light the pixel shows.
#ifndef RELIGHT_TRACE_PATH_GLSL
#define RELIGHT_TRACE_PATH_GLSL
#include "trace/layer.glsl"
#include "trace/sky.glsl"
#include "trace/random.glsl"
#include "trace/gbuffer.glsl"
#include "trace/camera.glsl"
#include "trace/motion.glsl"

// A path ends after this many layers and surfaces; what is left of its transmittance stays black. Far above what any
// scene stacks up, so this bounds only the time that a degenerate one takes.
const uint MAX_EVENTS = 512;
// Less of the background's display than this cannot be told from none in eight bits.
const float MIN_SHOWN = 1.0 / 1024.0;
// Lit layers that are no further from the surface behind them, units, are painted on it.
const float PAINT_DISTANCE = 0.5;
// See Path.solid_mask.
const uint PATHS_BIT = 8;
// Less of a reflection than this is not followed.
const float MIN_REFLECTION = 1.0 / 256.0;

// How a path was bent: not at all, by what keeps its shape, by ripples, which move while time goes on.
const uint BENT_NOT = 0, BENT_BY_SHAPE = 1, BENT_BY_RIPPLES = 2;

struct Path {
    vec3 origin;
    vec3 direction;
    vec3 transmittance; // of all that was passed but layers: mirrors, liquids
    vec3 radiance;      // of all that was passed but layers, and of what has none in front
    // Layers, fog among them, and what they lie in front of are summed as they are displayed (layer.glsl): of the
    // background, the part of its displayed value that they leave; the displayed sum; and what glows in it, to be
    // multiplied by the sum's slope.
    vec3 cover;
    vec3 shown;
    vec3 glow;
    float weight;       // one over the chance of the branches that were taken
    float travelled;    // length of the segments before this one
    LastSpace last;     // where points on the path were seen in the last frame
    vec3 eye_direction; // in which the eye sees the path
    uint bent;          // BENT_*: refracted, or mirrored by what is not flat: `last` is right for no more than its turn
    vec3 absorption;    // of the liquid that the path is in, per unit
    uint field;         // of a path that was split: 1 follows what is behind the surface, 2 what it reflects; 0: whole
    uint solid_mask; // from bit PATHS_BIT on: which portals were passed (PATHS_*); rays read the bits below alone
    uint layer_mask;
    uint events;
};

// The point whose light the pixel shows. Several lit layers can lie one behind the other; one of them is kept, with a
// chance that grows with what it contributes, and weighed by the inverse of that chance (reservoir sampling), so that
// the mean over frames is the sum of all.
GBufferPixel kept;
float kept_weight;
float weight_sum;
LastPlace kept_last;
uint kept_bent;
// The plane of the last lit surface, and whether that is the one that is kept: what is painted on a surface shares its
// light, so that both count as one and no chance comes between them.
vec4 lit_plane;
bool lit_kept;

// The solid surface that the path goes towards, or NO_HIT. Marks lie on it and have no light of their own to tell of.
Hit ahead;

// The glow of the layers in front, displayed, and where in the picture the brightest of them was in the last frame, relative to
// where it is; z negative: nobody knows.
vec3 glow_sum;
float brightest_glow;
vec3 glow_motion;
// Less glow than this, of display white, is not looked after.
const float MIN_GLOW = 1.0 / 256.0;

// Where a point of the path was seen in the last frame. What is seen bent is taken to stand where the eye sees it now.
LastSpace last_space(Path path, vec3 position, float t) {
    if (path.bent == BENT_NOT) return path.last;
    return LastSpace(path.last.linear, VIEW.camera.origin + path.eye_direction * (path.travelled + t) - path.last.linear * position);
}

void keep_lit(SurfacePoint p, vec3 lit, Path path, float t) {
    float weight = max_component(lit);
    if (!(weight > 0.0)) return;
    if (abs(dot(lit_plane.xyz, p.face_normal)) > 0.99 && abs(dot(lit_plane.xyz, p.position) - lit_plane.w) < PAINT_DISTANCE) {
        if (lit_kept) kept.albedo += lit;
        return;
    }
    lit_plane = vec4(p.face_normal, dot(p.face_normal, p.position));
    lit_kept = false;
    weight_sum += weight;
    if (weight_sum > weight && rng_next() * weight_sum >= weight) return;
    lit_kept = true;
    kept_weight = weight;
    kept.position = p.position;
    kept.view_distance = path.travelled + t;
    bool turned = dot(p.face_normal, path.direction) > 0.0;
    kept.face_normal = turned ? -p.face_normal : p.face_normal;
    // light is gathered on the side that is seen
    kept.normal = dot(p.normal, kept.face_normal) < 0.0 ? -p.normal : p.normal;
    kept.albedo = lit;
    kept.first_person = (instance_of(p.instance).flags & INSTANCE_FIRST_PERSON) != 0;
    kept_last = last_place(last_space(path, p.position, t), p, path.travelled + t);
    kept_bent = path.bent;
}

// Notes what glows in front of the surface that the pixel's motion is of. Only temporal antialiasing asks for it.
void note_glow(Path path, SurfacePoint p, vec3 emission, float t) {
    if (VIEW.antialias.history == 0 || emission == vec3(0.0)) return;
    vec3 glow = path.cover * encode_display(path.transmittance * emission);
    float brightest = max_component(glow);
    if (!(brightest > MIN_GLOW)) return;
    glow_sum += glow;
    if (brightest <= brightest_glow) return;
    brightest_glow = brightest;
    CameraRay ray = CameraRay(path.origin, path.direction, path.eye_direction, vec2(LAUNCH_PIXEL) + vec2(0.5) + VIEW.antialias.jitter);
    glow_motion = motion_of(ray, last_place(last_space(path, p.position, t), p, path.travelled + t)).xyz;
}

// How much of the pixel's light is there by what was not in front of the surface in the last frame, layers that move
// otherwise than it does, over what glows of it all (`front`): what they add to the display makes light behind them count
// for more, too. The history of the pixel is that of the surface and knows nothing of them.
float moved_glow(vec4 motion, vec3 front, vec3 shown) {
    if (glow_sum == vec3(0.0)) return 0.0;
    vec3 without = max(shown - glow_sum, 0.0);
    vec3 added = shown == vec3(0.0) ? front : shown * display_slope(shown) - without * display_slope(without);
    // of a pixel
    const float AT_REST = 0.25, AWAY = 1.0;
    float away = glow_motion.z < 0.0 || motion.z < 0.0 ? 1.0 : smoothstep(AT_REST, AWAY, distance(glow_motion.xy, motion.xy));
    return away * clamp(max_component(added) / max(MOST_FRESH * max_component(front), 1.0e-6), 0.0, 0.99);
}

// What a pixel sees of a surface: its parts in linear light, the displayed part of the background that it leaves, and what
// its texture shows of light that no ray finds: that which a lamp gives, and that which is added to models. It is part of
// the texture's display as any light on it.
struct SeenLayer {
    Layer linear;
    vec3 cover;
    vec3 own;
    float clear; // the part of its light that fog leaves
};

// `mirrors`: whether rays go on to what the surface reflects; else the picture of the environment stands for it. `clear`:
// what fog leaves of the layer, as it is displayed.
SeenLayer seen_layer(SurfacePoint p, Material material, Footprint seen, bool mirrors, float clear) {
    Layer shown = run_stages(material, p, seen, mirrors ? SEEN_FOLLOWED : SEEN_LAST);
    if (clear < 1.0) {
        shown.lit *= clear;
        shown.emission *= clear;
        shown.haze *= clear;
        shown.reflected *= clear;
        shown.through = mix(vec3(1.0), shown.through, clear);
    }
    Layer part = Layer(bounded_albedo(material, linear_part(shown.lit)), vec3(0.0), linear_part(shown.through), linear_part(shown.reflected), vec3(0.0));
    if (max_component(part.reflected) < MIN_REFLECTION) part.reflected = vec3(0.0);
    part.emission = linear_part(shown.emission + shown.haze);
    return SeenLayer(part, max(shown.through, 0.0), part.lit * (shown_glow(material) + added_light(p)), linear_part(vec3(clear)).x);
}

// Where the engine shows hardly any light and traced light falls, that would count for more than a display shows: in a
// sum it counts at most so many times of what it is alone.
const float MOST_GAIN = 4.0;

// Adds a displayed value to what the layers in front of it leave of the display. The light of the value counts as the
// result times the slope of the whole sum.
vec3 share_display(inout Path path, vec3 own) {
    path.shown += path.cover * own;
    return path.cover / display_slope(own);
}

// Adds what does not pass on light of others: sky.
void add_glow(inout Path path, vec3 radiance) {
    vec3 glow = path.transmittance * radiance;
    if (path.cover == vec3(1.0) && path.shown == vec3(0.0)) path.radiance += path.weight * glow;
    else path.glow += path.weight * glow * share_display(path, encode_display(glow));
}

// The light that the engine shows at a layer, linear.
vec3 light_shown(SurfacePoint p) {
    bool mark = (p.triangle.flags & TRIANGLE_WORLD) == 0 && (material_of(p.triangle.material).flags & MATERIAL_POLYGON_OFFSET) != 0;
    if (mark && ahead.geometry != NO_HIT) {
        SurfacePoint wall = surface_point(ahead);
        if (wall.kind != KIND_SKY) p = wall;
    }
    return decode_display(displayed_light(p));
}

void add_layer(inout Path path, SurfacePoint p, SeenLayer layer, float t) {
    vec3 lit = path.transmittance * layer.linear.lit, own = path.transmittance * layer.own;
    vec3 glow = path.transmittance * layer.linear.emission;
    bool glows = glow != vec3(0.0), is_lit = lit != vec3(0.0);
    bool alone = path.cover == vec3(1.0) && path.shown == vec3(0.0) && layer.cover == vec3(0.0) && !(glows && is_lit);
    if (alone) {
        path.radiance += path.weight * (glow + own);
        keep_lit(p, path.weight * lit, path, t);
    } else {
        if (glows) path.glow += path.weight * glow * share_display(path, encode_display(glow));
        if (is_lit) {
            vec3 share = share_display(path, encode_display(lit * light_shown(p) + own));
            path.glow += path.weight * own * share;
            keep_lit(p, path.weight * lit * min(share, path.cover * MOST_GAIN / display_slope(path.shown)), path, t);
        }
    }
    path.cover *= layer.cover;
    path.events++;
}

bool is_over(Path path) {
    // the root of light is nearly its displayed value
    return rays_wanted || max_component(path.cover * sqrt(path.transmittance)) < MIN_SHOWN || path.events >= MAX_EVENTS;
}

// What the pixel's cone meets of the surface.
Footprint footprint(Path path, SurfacePoint p, float t) {
    float cosine = max(abs(dot(p.face_normal, path.direction)), 0.05);
    float width = (path.travelled + t) * VIEW.camera.pixel_spread * VIEW.antialias.texture_scale;
    if (VIEW.antialias.anisotropy > 1.0) return ellipse_footprint(p, path.direction, cosine, width);
    return round_footprint(width * inversesqrt(cosine));
}

#endif
