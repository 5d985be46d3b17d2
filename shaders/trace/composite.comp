#version 460
// Puts light and surface together: what is in front + albedo * light. In reference mode it joins the running mean of the
// frames since anything changed. Where a reflection and what lies behind it are seen in one place, pixels show either in
// turns, like the fields of a chessboard: there a pixel is the mean of what it shows and of what it would show of the
// other field: that surface and what is in front of it it knows, its light is that of its neighbours.
#include "trace/denoise.glsl"
#include "trace/motion.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// The light of the fog that a pixel shows, between its cells.
vec3 light_in_fog(ivec2 pixel) {
    if (VIEW.fog.cell == 1) return imageLoad(images_rgba16f[VIEW.fog.filtered], pixel).rgb;
    vec2 at = (vec2(pixel) + 0.5) / float(VIEW.fog.cell) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 part = at - vec2(low);
    vec3 sum = vec3(0.0);
    float total = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        ivec2 cell = clamp(low + corner, ivec2(0), ivec2(VIEW.fog.width, VIEW.fog.height) - 1);
        vec4 light = imageLoad(images_rgba16f[VIEW.fog.filtered], cell);
        if (!(light.a > 0.0)) continue;
        vec2 share = mix(1.0 - part, part, vec2(corner)) + 1.0e-3;
        sum += light.rgb * (share.x * share.y);
        total += share.x * share.y;
    }
    return total > 0.0 ? sum / total : vec3(0.0);
}

// What a pixel shows by itself: albedo * light + front, or `front` alone where nothing is lit.
struct Shown {
    bool is_lit;
    vec3 albedo;
    vec3 light;
    vec3 front;
};

vec3 radiance_of(Shown s) { return s.is_lit ? s.albedo * s.light + s.front : s.front; }

Shown shown(ivec2 pixel) {
    GBufferPixel g = gbuffer_read(pixel);
    Shown s;
    // what glows by itself, sky and fog show as the engine shows them when the map is exposed to look as bright as there
    s.front = g.front * exp2(-VIEW.exposure.base);
    s.is_lit = g.view_distance >= 0.0;
    s.albedo = g.albedo;
    s.light = s.is_lit ? light_of(pixel) : vec3(0.0);
    return s;
}

vec3 lit_fog(ivec2 pixel) {
    if ((VIEW.fog.flags & FOG_LIT) == 0) return vec3(0.0);
    vec3 weight = light_read(VIEW.fog.weight, pixel);
    return max_component(weight) > 0.0 ? weight * light_in_fog(pixel) : vec3(0.0);
}

// What the pixels of the other field around a pixel show, as it would be seen at the pixel. Their light is the mean of
// them; what it falls on, and what glows, is known for the pixel itself, so that textures are as sharp as anywhere.
// False: there are none.
bool other_side(ivec2 pixel, float field, out vec3 other, out vec3 whole) {
    const ivec2 beside[4] = ivec2[](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
    GBufferPixel own;
    shown_read(VIEW.images.other, pixel, own);
    own.front *= exp2(-VIEW.exposure.base);
    bool is_lit = max_component(own.albedo) > 0.0;
    // to the sides, above and below: of those that show a surface where one is to be shown, and of all
    vec3 sums[2] = vec3[](vec3(0.0), vec3(0.0)), all_sum = vec3(0.0);
    float counts[2] = float[](0.0, 0.0), contrast[2] = float[](0.0, 0.0), any_count = 0.0, whole_count = 0.0;
    whole = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 at = pixel + beside[i];
        if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, ivec2(VIEW.width, VIEW.height)))) continue;
        float other_field = mark_field(mark_read(at));
        if (other_field == field) continue;
        Shown s = shown(at);
        vec3 fog = lit_fog(at);
        vec3 seen = radiance_of(s) + fog;
        if (other_field == 0.0) {
            whole += seen;
            whole_count += 1.0;
            continue;
        }
        all_sum += seen;
        any_count += 1.0;
        if (s.is_lit != is_lit) continue;
        vec3 value = own.albedo * s.light + own.front + fog;
        sums[i >> 1] += value;
        counts[i >> 1] += 1.0;
        contrast[i >> 1] += (i & 1) == 0 ? luminance(value) : -luminance(value);
    }
    whole /= max(whole_count, 1.0);
    if (whole_count == 0.0) whole = vec3(-1.0);
    other = vec3(0.0);
    if (any_count == 0.0) return false;
    if (counts[0] + counts[1] == 0.0) {
        other = is_lit ? all_sum / any_count : own.front;
        return true;
    }
    // along an edge rather than across it, so that a line is not seen in every other pixel alone
    vec2 weight = vec2(1.0);
    if (counts[0] == 2.0 && counts[1] == 2.0) weight = abs(vec2(contrast[1], contrast[0])) + 1.0e-4;
    other = (sums[0] * weight.x + sums[1] * weight.y) / (counts[0] * weight.x + counts[1] * weight.y);
    return true;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(VIEW.width, VIEW.height);
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    Shown own = shown(pixel);
    vec3 radiance = radiance_of(own) + lit_fog(pixel);
    float mark = mark_read(pixel);
    float field = mark_field(mark);
    bool lesser = false;
    if (field > 0.0) {
        vec3 other, whole;
        if (other_side(pixel, field, other, whole)) {
            lesser = luminance(radiance) < luminance(other);
            radiance = 0.5 * (radiance + other);
        } else {
            // alone, at an edge or where a reflection begins to be worth following: what is behind the surface counts
            // once, and is taken from beside it where it is not this pixel's own
            radiance *= 0.5;
            if (field == 2.0 && whole.r >= 0.0) radiance += whole;
        }
    }
    // one broken number must not spread through exposure and accumulation
    if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec3(0.0);
    if ((VIEW.flags & VIEW_ACCUMULATE) == 0) {
        // alpha: how much of the colour is of what has come here since the last frame; negative where most of it moves
        // not as this pixel's own surface does, but as those of the other field
        float fresh = min(mark_new_part(mark) * max_component(own.front) / max(max_component(radiance), 1.0e-6), 0.99);
        if (!(fresh > 0.0)) fresh = 0.0;
        // so is light that has changed: history of the whole colour is off by as much
        if (own.is_lit && (VIEW.flags & VIEW_DENOISE) != 0 && (DENOISE.flags & DENOISE_GRADIENTS) != 0) {
            vec2 change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
            fresh = max(fresh, min(max(change.x, change.y), 0.99));
        }
        fresh += LEAST_FRESH;
        imageStore(images_rgba16f[VIEW.images.composite], pixel, vec4(min(radiance, vec3(60000.0)), lesser ? -fresh : fresh));
        return;
    }
    if (VIEW.accumulated > 0) {
        vec3 mean = imageLoad(images_rgba32f[VIEW.images.accumulation], pixel).rgb;
        radiance = mean + (radiance - mean) / float(VIEW.accumulated + 1);
    }
    imageStore(images_rgba32f[VIEW.images.accumulation], pixel, vec4(radiance, 1.0));
}
