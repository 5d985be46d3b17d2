#version 460
// The light of this frame joins that of the frames before, where the surface that the pixel shows was in sight then
// (Schied et al., Spatiotemporal Variance-Guided Filtering, 2017, section 4.1 and 4.2), the more of it the more the
// light itself has changed (Schied et al., Gradient Estimation for Real-Time Adaptive Temporal Filtering, 2018,
// section 4.4). Direct and indirect light each have their history. Works on light without albedo, so textures stay
// sharp.
#include "trace/sparse.glsl"
#include "trace/slope.glsl"

// Whether there is bounced light at all.
layout(constant_id = 0) const uint BOUNCES = 1;

// Least weight of a new frame, of direct and indirect light.
const vec2 MIN_WEIGHT = vec2(0.05, 0.035);
const float MIN_VARIANCE_WEIGHT = 0.1;
// A change of the light by this part counts as much as the noise of one frame, filtered.
const float NOISE = 0.15;
// Frames before the variance over time can be trusted; until then it is taken over space.
const float TRUSTED_FRAMES = 4.0;
// How far around; of the rows every other one is enough.
const ivec2 AROUND = ivec2(3, 2);

// What the last frame left.
struct History {
    vec3 direct;
    vec3 indirect;
    vec2 variance; // of one frame's light
    vec2 frames;
    float weight;
};

void add_tap(inout History h, ivec2 tap, Before before, uint guide, vec3 normal, float tolerance, float weight) {
    if (!inside(tap) || !(weight > 0.0)) return;
    uint place = place_of(tap);
    LightTexel light = unpack_texel(LightTexels(DENOISE.history).at[place]);
    if (light.guide == 0 || ((light.guide ^ guide) & REFLECTION_BIT) != 0) return;
    if (abs(guide_depth(light.guide) - before.depth) > tolerance || dot(guide_normal(light.guide), normal) < 0.85) return;
    uint past = Pasts(DENOISE.last_past).at[place];
    h.direct += light.direct * weight;
    if (BOUNCES != 0) h.indirect += light.indirect * weight;
    h.variance += past_variance(past) * weight;
    h.frames += past_frames(past) * weight;
    h.weight += weight;
}

History history_at(ivec2 pixel, uint guide, vec3 normal, vec2 slope) {
    History h = History(vec3(0.0), vec3(0.0), vec2(0.0), vec2(0.0), 0.0);
    if ((DENOISE.flags & DENOISE_HISTORY) == 0) return h;
    Before before = before_of(pixel);
    if (!(before.depth > 0.0)) return h;
    // depths of taps differ by about as much as those of this frame's pixels, and by rounding
    float tolerance = before.depth * (0.01 + 2.0 * (abs(slope.x) + abs(slope.y))) + 0.1;
    vec2 low = floor(before.pixel), part = before.pixel - low;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1);
        float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
        // a place that is a rounding error off a pixel's middle is there
        add_tap(h, ivec2(low) + offset, before, guide, normal, tolerance, weight < 1.0e-3 ? 0.0 : weight);
    }
    if (h.weight < 0.01) return History(vec3(0.0), vec3(0.0), vec2(0.0), vec2(0.0), 0.0);
    float scale = 1.0 / h.weight;
    return History(h.direct * scale, h.indirect * scale, h.variance * scale, h.frames * scale, h.weight);
}

// Variance of the luminance of this frame's light around a pixel.
vec2 variance_around(ivec2 pixel, float depth, vec2 slope, bool takes_turns) {
    vec4 moments = vec4(0.0);
    float count = 0.0;
    for (int y = -AROUND.y; y <= AROUND.y; y += 2) {
        for (int x = -AROUND.x; x <= AROUND.x; x++) {
            ivec2 tap = pixel + ivec2(x, y);
            if (takes_turns && ((x ^ y) & 1) != 0) continue;
            float other = depth_at(tap);
            if (other == 0.0 || abs(depth / other - 1.0 - dot(slope, vec2(x, y))) > 0.02) continue;
            vec2 l = vec2(luminance(light_read(VIEW.image_direct, tap)), BOUNCES != 0 ? luminance(light_read(VIEW.image_indirect, tap)) : 0.0);
            moments += vec4(l, l * l);
            count += 1.0;
        }
    }
    moments /= max(count, 1.0);
    return max(moments.zw - moments.xy * moments.xy, vec2(0.0));
}

// Whether the pixel is the one of its stratum that may be kept for the next frame's gradient; `again`: it is a gradient
// sample itself, whose random numbers are older than this frame.
bool is_kept(ivec2 pixel, ivec2 stratum, out bool again) {
    again = false;
    Carried c = Carried(false, false, 0, ivec2(0));
    if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) c = carried_at(stratum);
    // one whose turn it is where bounced light is not gathered everywhere: in each direction there are one or two
    bool sparse = (VIEW.flags & VIEW_SPARSE_BOUNCE) != 0;
    int random = int(4.0 * dither(stratum, 3));
    ivec2 corner = stratum * STRATUM, first, choice;
    first.y = sparse ? (turn(0).y + corner.y) & 1 : int(dither(stratum, 7) < 0.5);
    choice.y = first.y + (first.y == 0 && (random & 2) != 0 ? 2 : 0);
    first.x = sparse ? (turn((corner.y + choice.y) / CELL).x + corner.x) & 1 : int(dither(stratum, 6) < 0.5);
    choice.x = first.x + (first.x == 0 && (random & 1) != 0 ? 2 : 0);
    int index = choice.y * STRATUM + choice.x;
    if (c.valid && c.index == index) {
        // another of the same turn, or any other
        if (first.x == 0) index += choice.x == 0 ? 2 : -2;
        else if (first.y == 0) index = (2 - choice.y) * STRATUM;
        else index = 0;
    }
    // at the right and the lower edge strata are cut off
    if (pixel != min(pixel_of(stratum, index), ivec2(VIEW.width, VIEW.height) - 1)) return false;
    again = c.valid && pixel == pixel_of(stratum, c.index);
    return true;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    load_depths();
    if (!inside(pixel)) return;
    float depth = own_depth();
    ivec2 stratum = pixel / STRATUM;
    bool again, kept = is_kept(pixel, stratum, again);
    if (kept && (depth == 0.0 || again)) {
        keep_nothing(stratum);
        kept = false;
    }
    if (depth == 0.0) {
        LightTexels(DENOISE.fresh).at[place_of(pixel)] = uvec4(0);
        return;
    }
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.image_surface], pixel).xy;
    vec3 normal = unpack_normal(surface.y);
    float field = mark_field(mark_read(pixel));
    vec2 slope = slope_at(depth, field > 0.0);

    LightTexel light;
    light.direct = light_read(VIEW.image_direct, pixel);
    light.indirect = BOUNCES != 0 ? light_read(VIEW.image_indirect, pixel) : vec3(0.0);
    light.guide = pack_guide(depth, normal, field == 2.0);
    vec2 value = vec2(luminance(light.direct), luminance(light.indirect));

    if (kept) keep_sample(stratum, pixel, imageLoad(images_rgba32f[VIEW.image_position], pixel), surface, is_gathered(pixel) ? value : vec2(value.x, -1.0));

    History h = history_at(pixel, light.guide, normal, slope);
    vec2 frames = vec2(0.0), variance = vec2(0.0);
    if (h.weight > 0.0) {
        frames = h.frames;
        vec2 weight = MIN_WEIGHT, change = vec2(0.0);
        if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) {
            // The part of the light that has changed is error in the history; against the noise of the light it is what
            // decides. As only this frame sees the change, what is older than it loses its say for good.
            // A light that comes or goes changes for many frames, so the history errs by more than the last change: the
            // weight is the steady gain of Kalman's filter (A New Approach to Linear Filtering and Prediction Problems,
            // 1960) for a value that wanders by `change` a frame, observed with the noise, which is relative to what is left.
            change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
            vec2 left = NOISE * (1.0 - change);
            vec2 ratio = change * change / max(left * left, 1.0e-6);
            change = 2.0 / (1.0 + sqrt(1.0 + 4.0 / max(ratio, 1.0e-12)));
            frames *= 1.0 - change;
            weight = max(weight, change);
        }
        weight = max(weight, 1.0 / (frames + 1.0));
        // what is known to be change is no noise
        vec2 away = (1.0 - change) * (value - vec2(luminance(h.direct), luminance(h.indirect)));
        variance = mix(h.variance * (1.0 - change), away * away, max(weight, MIN_VARIANCE_WEIGHT));
        light.direct = mix(h.direct, light.direct, weight.x);
        light.indirect = mix(h.indirect, light.indirect, weight.y);
    }
    frames = min(frames + 1.0, 1.0 / MIN_WEIGHT);
    if (min(frames.x, frames.y) < TRUSTED_FRAMES) {
        vec2 around = variance_around(pixel, depth, slope, field > 0.0);
        variance = mix(variance, max(variance, around), lessThan(frames, vec2(TRUSTED_FRAMES)));
    }
    // of the mean over the frames: what has settled is left as it is
    light.variance = variance / min(frames, 2.0 / MIN_WEIGHT - 1.0);

    LightTexels(DENOISE.fresh).at[place_of(pixel)] = pack_texel(light, dither(pixel, 0));
    imageStore(images_rg16f[DENOISE.slope], pixel, vec4(slope, 0.0, 0.0));
    float random = dither(pixel, 1);
    Pasts(DENOISE.past).at[place_of(pixel)] = pack_past(frames, variance, fract(random + vec4(0.0, 0.25, 0.5, 0.75)));
}
