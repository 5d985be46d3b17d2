#version 460
// Combines light and surface: front + albedo * light. In reference mode adds the frame to the running mean since the
// last change. Where a surface both reflects and refracts, pixels form a checkerboard of two fields. There a pixel is
// the mean of both: of the other field it has the albedo and the front itself (`other`), and takes the light from its
// neighbours.
#include "trace/denoise.glsl"
#include "trace/motion.glsl"
#include "trace/specular_surface.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// The light of fog at a pixel, interpolated between fog cells.
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

// Radiance of the pixel's own field: albedo * light + front, or `front` alone if nothing is lit.
struct Shown {
    bool is_lit;
    vec3 albedo;
    vec3 light;
    vec3 front;
    vec3 gloss; // specular light that the surface reflects
};

vec3 radiance_of(Shown s) { return (s.is_lit ? s.albedo * s.light + s.front : s.front) + s.gloss; }

Shown shown(ivec2 pixel) {
    GBufferPixel g;
    shown_read(VIEW.images.shown, pixel, g);
    Shown s;
    // at the map's base exposure, self-luminous surfaces, sky and fog show as in the engine
    s.front = g.front * exp2(-VIEW.exposure.base);
    s.is_lit = is_lit_read(pixel);
    s.albedo = g.albedo;
    s.light = s.is_lit ? light_of(pixel) : vec3(0.0);
    s.gloss = shown_gloss(pixel);
    return s;
}

vec3 lit_fog(ivec2 pixel) {
    if ((VIEW.fog.flags & FOG_LIT) == 0) return vec3(0.0);
    vec3 weight = light_read(VIEW.fog.weight, pixel);
    return max_component(weight) > 0.0 ? weight * light_in_fog(pixel) : vec3(0.0);
}

// Radiance of the other field at this pixel. The light is the mean of the neighbours'; albedo and front are the pixel's
// own, so that textures stay sharp. False: no neighbour belongs to the other field.
bool other_side(ivec2 pixel, float field, out vec3 other, out vec3 whole) {
    const ivec2 beside[4] = ivec2[](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
    GBufferPixel own;
    shown_read(VIEW.images.other, pixel, own);
    own.front *= exp2(-VIEW.exposure.base);
    // metal has no albedo: what has neither that nor a front takes the light of any neighbour
    bool is_lit = max_component(own.albedo) > 0.0, any_kind = HAS_GLOSS != 0 && !is_lit && own.front == vec3(0.0);
    // horizontal and vertical pairs: sums over neighbours with a matching surface, and over all
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
        if (s.is_lit != is_lit && !any_kind) continue;
        vec3 value = own.albedo * s.light + own.front + s.gloss + fog;
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
    // along an edge rather than across it, so that a line does not appear in every second pixel only
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
            // no neighbour: at an edge, or where a reflection becomes strong enough to be followed. The refracted side
            // counts once, and comes from the neighbours if it is not the pixel's own
            radiance *= 0.5;
            if (field == 2.0 && whole.r >= 0.0) radiance += whole;
        }
    }
    // a single NaN or infinity would spread through exposure and accumulation
    if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec3(0.0);
    if ((VIEW.flags & VIEW_ACCUMULATE) == 0) {
        // alpha: fraction of the colour that is new since the last frame; negative if most of it moves with the surface
        // of the other field
        float fresh = min(mark_new_part(mark) * max_component(own.front) / max(max_component(radiance), 1.0e-6), 0.99);
        if (!(fresh > 0.0)) fresh = 0.0;
        // changed light counts as new too: the history of the whole colour is wrong by that fraction
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
