#version 460
// A-SVGF: joins the light of this frame with the history, where the surface was visible in the last frame (Schied et
// al., Spatiotemporal Variance-Guided Filtering, 2017, sections 4.1 and 4.2). The larger the change of the light
// itself, the less history is used (Schied et al., Gradient Estimation for Real-Time Adaptive Temporal Filtering, 2018,
// section 4.4). Direct and indirect light have separate histories. Light is demodulated, so that textures stay sharp.
#include "trace/subsample.glsl"
#include "trace/depth_gradient.glsl"

// 1: there is bounced light.
layout(constant_id = 0) const uint BOUNCES = 1;

// Least weight of a new frame, of direct and indirect light.
const vec2 MIN_WEIGHT = vec2(0.05, 0.035);
const float MIN_VARIANCE_WEIGHT = 0.1;
// Weight of the other eye's bounced light.
const float OTHER_EYE = 0.25;
// Filtered noise of one frame, as a relative change of the light.
const float NOISE = 0.15;
// Frames after which the variance over time is reliable; before, it is estimated over space.
const float TRUSTED_FRAMES = 4.0;
// Largest squared difference of the guides' normals on one surface: a cosine of 0.85.
const float MAX_NORMAL_DIFFERENCE = 67.5;
// Vertical radius of the spatial variance estimate, pixels of the work group.
const int VARIANCE_RADIUS = 2;

// Levels of this frame's light in the work group.
shared vec2 levels[TILE * TILE];

// History of a pixel; weight 0: none.
struct History {
    LightTexel light; // its variance is that of one frame
    vec2 frames;
    float weight;
};

// Adds a tap of the history. Colours are summed as codes, weighted by the level. `normal`: components of the guide;
// `range`: least and greatest inverse depth of the same surface.
void add_tap(inout History h, LightTexels texels, ivec2 tap, vec3 normal, vec2 range, float weight) {
    if (!inside(tap) || !(weight > 0.0)) return;
    uvec4 texel = texels.at[place_of(tap)];
    float inverse = guide_inverse(texel.w);
    vec3 bend = guide_components(texel.w) - normal;
    // the inverse depth of a pixel without a surface is 0
    if (inverse < range.x || inverse > range.y || dot(bend, bend) > MAX_NORMAL_DIFFERENCE) return;
    vec2 level = unpackHalf2x16(texel.x) * weight;
    h.light.level += level;
    h.light.green += green_code(texel.y) * level;
    h.light.red += red_code(texel.y) * level;
    h.light.variance += past_variance(texel.z) * weight;
    h.frames += past_frames(texel.z) * weight;
    h.weight += weight;
}

const History NO_HISTORY = History(LightTexel(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0), vec2(0.0), 0.0);

// History of the surface at a position of an earlier picture, or of the other eye's.
History history_in(LightTexels texels, LastPixel last, uint guide, vec2 depth_gradient) {
    History h = NO_HISTORY;
    if (!(last.depth > 0.0)) return h;
    // tolerance for the depth gradient of the taps and for rounding
    float tolerance = last.depth * (0.01 + 2.0 * (abs(depth_gradient.x) + abs(depth_gradient.y))) + 0.1;
    vec2 range = INVERSE_SCALE / vec2(last.depth + tolerance, max(last.depth - tolerance, NEAREST_DEPTH));
    vec3 normal = guide_components(guide);
    vec2 low = floor(last.pixel), part = last.pixel - low;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1);
        float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
        // weights near 0 are rounding errors of a position at the centre of a pixel
        add_tap(h, texels, ivec2(low) + offset, normal, range, weight < 1.0e-3 ? 0.0 : weight);
    }
    if (h.weight < 0.01) return NO_HISTORY;
    float scale = 1.0 / h.weight;
    h.light.green = (h.light.green - CODE_GREY * h.light.level) * (CODE_SCALE * scale);
    h.light.red = (h.light.red - CODE_GREY * h.light.level) * (CODE_SCALE * scale);
    h.light.level *= scale;
    h.light.variance *= scale;
    h.frames *= scale;
    return h;
}

// History of a pixel. Of what the other eye shows, too, it has the other's where it has none, and a part of the other's
// bounced light where its own is not fresh (Willberger et al., section 26.7.1).
History history_at(ivec2 pixel, uint guide, float depth, vec2 depth_gradient, bool is_fresh) {
    History h = NO_HISTORY;
    if ((DENOISE.flags & DENOISE_HISTORY) != 0) h = history_in(LightTexels(DENOISE.history), last_pixel_of(pixel), guide, depth_gradient);
    if (SHARED_EYES == 0 || h.weight > 0.0 && is_fresh) return h;
    History other = history_in(LightTexels(DENOISE.other_eye), LastPixel(other_eye_pixel(pixel, depth), depth), guide, depth_gradient);
    if (other.weight == 0.0) return h;
    if (h.weight == 0.0) return other;
    h.light.level.y = mix(h.light.level.y, other.light.level.y, OTHER_EYE);
    h.light.green.y = mix(h.light.green.y, other.light.green.y, OTHER_EYE);
    h.light.red.y = mix(h.light.red.y, other.light.red.y, OTHER_EYE);
    h.light.variance.y = mix(h.light.variance.y, other.light.variance.y, OTHER_EYE);
    h.frames.y = mix(h.frames.y, other.frames.y, OTHER_EYE);
    return h;
}

// Variance of the level of this frame's light around the pixel, over pixels of the work group on the same surface:
// every other row and column, which belong to the same field of the checkerboard. Reads shared memory only, because the
// whole work group waits for a single pixel that needs it.
vec2 variance_around(float depth, vec2 depth_gradient) {
    ivec2 own = ivec2(gl_LocalInvocationID.xy);
    vec4 moments = vec4(0.0);
    float count = 0.0;
    for (int y = max(own.y - VARIANCE_RADIUS, own.y & 1); y <= min(own.y + VARIANCE_RADIUS, TILE - 1); y += 2) {
        for (int x = own.x & 1; x < TILE; x += 2) {
            float other = depths[(y + 1) * (TILE + 2) + x + 1];
            if (other == 0.0 || abs(depth / other - 1.0 - dot(depth_gradient, vec2(ivec2(x, y) - own))) > 0.02) continue;
            vec2 level = levels[y * TILE + x];
            if (ADAPTIVE != 0 && level.y < 0.0) continue;
            moments += vec4(level, level * level);
            count += 1.0;
        }
    }
    moments /= max(count, 1.0);
    return max(moments.zw - moments.xy * moments.xy, vec2(0.0));
}

// For each stratum of the work group: the pixel that may become the next frame's gradient sample (`pack_place`).
const int STRATA = TILE / STRATUM + 2;
shared uint choices[STRATA * STRATA];
// That pixel is a gradient sample itself, with random numbers older than this frame; it has gathered bounced light.
const uint AGAIN = 1u << 31, GATHERED = 1u << 30;

uint choice_of(ivec2 stratum) {
    stratum = min(stratum, (ivec2(VIEW.width, VIEW.height) - 1) / STRATUM);
    GradientPixel c = GradientPixel(false, false, 0, ivec2(0));
    if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) c = gradient_pixel_at(stratum);
    // with subsampled bounced light a pixel that gathers: one or two along each axis of the stratum
    bool sparse = (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) != 0;
    int random = int(4.0 * dither(stratum, DITHER_SAMPLE));
    ivec2 corner = stratum * STRATUM, first, choice;
    first.y = sparse ? (gathered_offset(0).y + corner.y) & 1 : int(dither(stratum, DITHER_SAMPLE_ROW) < 0.5);
    choice.y = first.y + (first.y == 0 && (random & 2) != 0 ? 2 : 0);
    first.x = sparse ? (gathered_offset((corner.y + choice.y) / CELL).x + corner.x) & 1 : int(dither(stratum, DITHER_SAMPLE_COLUMN) < 0.5);
    choice.x = first.x + (first.x == 0 && (random & 1) != 0 ? 2 : 0);
    int index = choice.y * STRATUM + choice.x;
    if (c.valid && c.index == index) {
        // another pixel that gathers, or any other
        if (first.x == 0) index += choice.x == 0 ? 2 : -2;
        else if (first.y == 0) index = (2 - choice.y) * STRATUM;
        else index = 0;
    }
    // strata are cut off at the right and lower edge
    ivec2 pixel = min(pixel_of(stratum, index), ivec2(VIEW.width, VIEW.height) - 1);
    return pack_place(pixel) | (c.valid && pixel == pixel_of(stratum, c.index) ? AGAIN : 0) | (is_gathered(pixel) ? GATHERED : 0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 stratum = pixel / STRATUM, first_stratum = ivec2(gl_WorkGroupID.xy) * TILE / STRATUM;
    int index = int(gl_LocalInvocationIndex);
    if (index < STRATA * STRATA) choices[index] = choice_of(first_stratum + ivec2(index % STRATA, index / STRATA));
    vec3 direct = vec3(0.0), indirect = vec3(0.0);
    // the pixel has bounced light of this frame
    bool is_fresh = true;
    if (inside(pixel)) {
        direct = light_read(VIEW.images.direct, pixel);
        if (BOUNCES != 0) {
            uint packed = imageLoad(uimages_r32ui[VIEW.images.indirect], pixel).x;
            if (ADAPTIVE != 0) is_fresh = packed != NOT_GATHERED;
            if (is_fresh) indirect = unpack_light(packed);
        }
    }
    vec2 luminances = vec2(luminance(direct), luminance(indirect));
    direct = texel_of(direct);
    indirect = texel_of(indirect);
    levels[index] = vec2(direct.x, is_fresh ? indirect.x : -1.0);
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
        keep_sample(stratum, pixel, surface, luminances);
    }

    History h = history_at(pixel, light.guide, depth, depth_gradient, is_fresh);
    vec2 frames = vec2(0.0), variance = vec2(0.0);
    if (h.weight > 0.0) {
        frames = h.frames;
        if (ADAPTIVE != 0) frames.y *= distortion(pixel);
        vec2 weight = MIN_WEIGHT, change = vec2(0.0);
        if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) {
            // A change of the light makes the history wrong by that fraction; the weight follows from the ratio of
            // change and noise. Only this frame detects the change, so the number of frames is reduced for good. A
            // light that is switched changes for many frames, so the error of the history exceeds the last change. The
            // weight is the steady-state gain of a Kalman filter (A New Approach to Linear Filtering and Prediction
            // Problems, 1960) for a value that drifts by `change` a frame, observed with noise proportional to the
            // unchanged part.
            change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
            vec2 left = NOISE * (1.0 - change);
            vec2 ratio = change * change / max(left * left, 1.0e-6);
            change = 2.0 / (1.0 + sqrt(1.0 + 4.0 / max(ratio, 1.0e-12)));
            frames *= 1.0 - change;
            // the next frame has samples, and does not detect this change any more; few places detect that of bounced light
            if (!is_fresh) frames.y = min(frames.y, 1.0 / max(max(change.x, change.y), 1.0e-3) - 1.0);
            weight = max(weight, change);
        }
        weight = max(weight, 1.0 / (frames + 1.0));
        if (!is_fresh) weight.y = 0.0;
        // a known change is not noise
        vec2 away = (1.0 - change) * (light.level - h.light.level);
        variance = mix(h.light.variance * (1.0 - change), away * away, max(weight, MIN_VARIANCE_WEIGHT));
        if (!is_fresh) variance.y = h.light.variance.y;
        light.level = mix(h.light.level, light.level, weight);
        light.green = mix(h.light.green, light.green, weight);
        light.red = mix(h.light.red, light.red, weight);
    }
    frames = min(frames + vec2(1.0, is_fresh ? 1.0 : 0.0), 1.0 / MIN_WEIGHT);
    if (min(frames.x, frames.y) < TRUSTED_FRAMES) {
        vec2 around = variance_around(depth, depth_gradient);
        variance = mix(variance, max(variance, around), lessThan(frames, vec2(TRUSTED_FRAMES)));
    }
    // variance of the mean over frames, so that converged pixels are filtered little
    light.variance = variance / min(frames, 2.0 / MIN_WEIGHT - 1.0);

    LightTexels(DENOISE.fresh).at[place_of(pixel)] = pack_texel(light, dither(pixel, DITHER_FRESH));
    imageStore(images_rg16f[DENOISE.depth_gradient], pixel, vec4(depth_gradient, 0.0, 0.0));
    float random = dither(pixel, DITHER_PAST);
    uint past = pack_past(frames, variance, fract(random + vec4(0.0, 0.25, 0.5, 0.75)));
    imageStore(uimages_r32ui[DENOISE.past], pixel, uvec4(past));
}
