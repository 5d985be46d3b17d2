#version 460
// The light of this frame joins that of the frames before, where the surface that the pixel shows was in sight then
// (Schied et al., Spatiotemporal Variance-Guided Filtering, 2017, section 4.1 and 4.2), the more of it the more the
// light itself has changed (Schied et al., Gradient Estimation for Real-Time Adaptive Temporal Filtering, 2018,
// section 4.4). Direct and indirect light each have their history. Works on light without albedo, so textures stay
// sharp.
#include "trace/subsample.glsl"
#include "trace/depth_gradient.glsl"

// Whether there is bounced light at all.
layout(constant_id = 0) const uint BOUNCES = 1;

// Least weight of a new frame, of direct and indirect light.
const vec2 MIN_WEIGHT = vec2(0.05, 0.035);
const float MIN_VARIANCE_WEIGHT = 0.1;
// A change of the light by this part counts as much as the noise of one frame, filtered.
const float NOISE = 0.15;
// Frames before the variance over time can be trusted; until then it is taken over space.
const float TRUSTED_FRAMES = 4.0;
// Square of the difference of two normals' components beyond which they are of two surfaces: a cosine of 0.85.
const float MOST_BEND = 67.5;
// How far up and down it is taken from, of the pixels of the group.
const int AROUND = 2;

// Levels of this frame's light of the group's pixels.
shared vec2 levels[TILE * TILE];

// What the last frame left; all zero: nothing.
struct History {
    LightTexel light; // whose variance is that of one frame's
    vec2 frames;
    float weight;
};

// Colours are summed up as codes, times the level. `normal`: components of the guide; `range`: least and greatest inverse of
// the depth that is the surface's.
void add_tap(inout History h, ivec2 tap, vec3 normal, vec2 range, float weight) {
    if (!inside(tap) || !(weight > 0.0)) return;
    uint place = place_of(tap);
    uvec4 texel = LightTexels(DENOISE.history).at[place];
    float inverse = guide_inverse(texel.w);
    vec3 bend = guide_components(texel.w) - normal;
    // where there is nothing to light the inverse is 0
    if (inverse < range.x || inverse > range.y || dot(bend, bend) > MOST_BEND) return;
    uint past = Pasts(DENOISE.last_past).at[place];
    vec2 level = unpackHalf2x16(texel.x) * weight;
    h.light.level += level;
    h.light.green += green_code(texel.y) * level;
    h.light.red += red_code(texel.y) * level;
    h.light.variance += past_variance(past) * weight;
    h.frames += past_frames(past) * weight;
    h.weight += weight;
}

History history_at(ivec2 pixel, uint guide, vec2 depth_gradient) {
    const History NONE = History(LightTexel(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0), vec2(0.0), 0.0);
    History h = NONE;
    if ((DENOISE.flags & DENOISE_HISTORY) == 0) return h;
    Before before = before_of(pixel);
    if (!(before.depth > 0.0)) return h;
    // depths of taps differ by about as much as those of this frame's pixels, and by rounding
    float tolerance = before.depth * (0.01 + 2.0 * (abs(depth_gradient.x) + abs(depth_gradient.y))) + 0.1;
    vec2 range = INVERSE_SCALE / vec2(before.depth + tolerance, max(before.depth - tolerance, NEAREST_DEPTH));
    vec3 normal = guide_components(guide);
    vec2 low = floor(before.pixel), part = before.pixel - low;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1);
        float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
        // a place that is a rounding error off a pixel's middle is there
        add_tap(h, ivec2(low) + offset, normal, range, weight < 1.0e-3 ? 0.0 : weight);
    }
    if (h.weight < 0.01) return NONE;
    float scale = 1.0 / h.weight;
    h.light.green = (h.light.green - CODE_GREY * h.light.level) * (CODE_SCALE * scale);
    h.light.red = (h.light.red - CODE_GREY * h.light.level) * (CODE_SCALE * scale);
    h.light.level *= scale;
    h.light.variance *= scale;
    h.frames *= scale;
    return h;
}

// Variance of the level of this frame's light around the pixel, of what the group has of its surface: of every other row and
// column, which show the same where pixels take turns. Where one pixel asks for it the others wait, so it reads no memory.
vec2 variance_around(float depth, vec2 depth_gradient) {
    ivec2 own = ivec2(gl_LocalInvocationID.xy);
    vec4 moments = vec4(0.0);
    float count = 0.0;
    for (int y = max(own.y - AROUND, own.y & 1); y <= min(own.y + AROUND, TILE - 1); y += 2) {
        for (int x = own.x & 1; x < TILE; x += 2) {
            float other = depths[(y + 1) * (TILE + 2) + x + 1];
            if (other == 0.0 || abs(depth / other - 1.0 - dot(depth_gradient, vec2(ivec2(x, y) - own))) > 0.02) continue;
            vec2 level = levels[y * TILE + x];
            moments += vec4(level, level * level);
            count += 1.0;
        }
    }
    moments /= max(count, 1.0);
    return max(moments.zw - moments.xy * moments.xy, vec2(0.0));
}

// Of each stratum of the group the pixel that may be kept for the next frame's gradient, as `pack_place` does it.
const int STRATA = TILE / STRATUM + 2;
shared uint choices[STRATA * STRATA];
// That pixel is a gradient sample itself, whose random numbers are older than this frame; bounced light was gathered for it.
const uint AGAIN = 1u << 31, GATHERED = 1u << 30;

uint choice_of(ivec2 stratum) {
    stratum = min(stratum, (ivec2(VIEW.width, VIEW.height) - 1) / STRATUM);
    GradientPixel c = GradientPixel(false, false, 0, ivec2(0));
    if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) c = gradient_pixel_at(stratum);
    // one whose turn it is where bounced light is not gathered everywhere: in each direction there are one or two
    bool sparse = (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) != 0;
    int random = int(4.0 * dither(stratum, DITHER_SAMPLE));
    ivec2 corner = stratum * STRATUM, first, choice;
    first.y = sparse ? (gathered_offset(0).y + corner.y) & 1 : int(dither(stratum, DITHER_SAMPLE_ROW) < 0.5);
    choice.y = first.y + (first.y == 0 && (random & 2) != 0 ? 2 : 0);
    first.x = sparse ? (gathered_offset((corner.y + choice.y) / CELL).x + corner.x) & 1 : int(dither(stratum, DITHER_SAMPLE_COLUMN) < 0.5);
    choice.x = first.x + (first.x == 0 && (random & 1) != 0 ? 2 : 0);
    int index = choice.y * STRATUM + choice.x;
    if (c.valid && c.index == index) {
        // another of the same turn, or any other
        if (first.x == 0) index += choice.x == 0 ? 2 : -2;
        else if (first.y == 0) index = (2 - choice.y) * STRATUM;
        else index = 0;
    }
    // at the right and the lower edge strata are cut off
    ivec2 pixel = min(pixel_of(stratum, index), ivec2(VIEW.width, VIEW.height) - 1);
    return pack_place(pixel) | (c.valid && pixel == pixel_of(stratum, c.index) ? AGAIN : 0) | (is_gathered(pixel) ? GATHERED : 0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 stratum = pixel / STRATUM, first_stratum = ivec2(gl_WorkGroupID.xy) * TILE / STRATUM;
    int index = int(gl_LocalInvocationIndex);
    if (index < STRATA * STRATA) choices[index] = choice_of(first_stratum + ivec2(index % STRATA, index / STRATA));
    vec3 direct = vec3(0.0), indirect = vec3(0.0);
    if (inside(pixel)) {
        direct = light_read(VIEW.images.direct, pixel);
        if (BOUNCES != 0) indirect = light_read(VIEW.images.indirect, pixel);
    }
    vec2 luminances = vec2(luminance(direct), luminance(indirect));
    direct = texel_of(direct);
    indirect = texel_of(indirect);
    levels[index] = vec2(direct.x, indirect.x);
    load_depths();
    if (!inside(pixel)) return;
    float depth = own_depth();
    ivec2 in_group = stratum - first_stratum;
    uint choice = choices[in_group.y * STRATA + in_group.x];
    bool kept = (choice & ~(AGAIN | GATHERED)) == pack_place(pixel);
    if (kept && (depth == 0.0 || choice >= AGAIN)) {
        keep_nothing(stratum);
        kept = false;
    }
    if (depth == 0.0) {
        LightTexels(DENOISE.fresh).at[place_of(pixel)] = uvec4(0);
        return;
    }
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).xy;
    vec3 normal = unpack_normal(surface.y);
    float field = mark_field(mark_read(pixel));
    vec2 depth_gradient = depth_gradient_at(depth, field > 0.0);

    LightTexel light;
    light.level = vec2(direct.x, indirect.x);
    light.green = vec2(direct.y, indirect.y);
    light.red = vec2(direct.z, indirect.z);
    light.guide = pack_guide(depth, normal, field == 2.0);

    if (kept) {
        if ((choice & GATHERED) == 0) luminances.y = -1.0;
        keep_sample(stratum, pixel, imageLoad(images_rgba32f[VIEW.images.position], pixel), surface, luminances);
    }

    History h = history_at(pixel, light.guide, depth_gradient);
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
        vec2 away = (1.0 - change) * (light.level - h.light.level);
        variance = mix(h.light.variance * (1.0 - change), away * away, max(weight, MIN_VARIANCE_WEIGHT));
        light.level = mix(h.light.level, light.level, weight);
        light.green = mix(h.light.green, light.green, weight);
        light.red = mix(h.light.red, light.red, weight);
    }
    frames = min(frames + 1.0, 1.0 / MIN_WEIGHT);
    if (min(frames.x, frames.y) < TRUSTED_FRAMES) {
        vec2 around = variance_around(depth, depth_gradient);
        variance = mix(variance, max(variance, around), lessThan(frames, vec2(TRUSTED_FRAMES)));
    }
    // of the mean over the frames: what has settled is left as it is
    light.variance = variance / min(frames, 2.0 / MIN_WEIGHT - 1.0);

    LightTexels(DENOISE.fresh).at[place_of(pixel)] = pack_texel(light, dither(pixel, DITHER_FRESH));
    imageStore(images_rg16f[DENOISE.depth_gradient], pixel, vec4(depth_gradient, 0.0, 0.0));
    float random = dither(pixel, DITHER_PAST);
    Pasts(DENOISE.past).at[place_of(pixel)] = pack_past(frames, variance, fract(random + vec4(0.0, 0.25, 0.5, 0.75)));
}
