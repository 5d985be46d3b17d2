#version 460
// A step of the edge-avoiding a-trous wavelet filter (Dammertz et al., HPG 2010), guided by normals, the surface's
// plane and the variance of the light (Schied et al. 2017, sections 4.3 and 4.4). The kernel is 3 x 3. Direct and
// indirect light share the weights of the surface and have their own weights of luminance.
#define FILTER_STEP
#extension GL_EXT_control_flow_attributes : require
#include "trace/denoise.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: there is bounced light.
layout(constant_id = 0) const uint BOUNCES = 1;
// 1: the variance is averaged over the taps, because the variance of fresh light is itself noisy.
layout(constant_id = 1) const uint NOISY_VARIANCE = 1;
// 1: last step; writes the sum of direct and indirect light to the image of direct light, and the number of frames and
// the variance of the fresh light into the history, whose own variance has served.
layout(constant_id = 2) const uint LAST = 0;

// Luminance tolerance in standard deviations, of direct and indirect light.
const vec2 LUMINANCE_SIGMA = vec2(4.0, 6.0);
const float LOG2_E = 1.44269504;

// Scale of the squared difference of the guides' normals in the exponent: for unit normals about the 64th power of
// their cosine. The reflection bit separates reflections from all other pixels.
const float NORMAL_SCALE = 0.205; // 32 log2(e) / 15^2

// Both kinds of light, or direct light alone.
vec2 of_kinds(vec2 v) { return BOUNCES != 0 ? v : vec2(v.x, 0.0); }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    uint place = place_of(pixel);
    uvec4 own = LightTexels(push.source).at[place];
    uint guide = own.w;
    if (guide == 0) {
        if (LAST == 0) LightTexels(push.target).at[place] = uvec4(0);
        return;
    }
    int spacing = int(push.spacing);
    vec3 normal = guide_components(guide);
    float depth = guide_depth(guide);
    vec2 depth_gradient = imageLoad(images_rg16f[DENOISE.depth_gradient], pixel).xy * float(spacing);

    // The plane in camera space: its point at tangent (x, y) has the inverse depth a x + b y + c.
    vec2 tangent = tangent_of(vec2(pixel));
    vec2 rate = -depth_gradient / (float(spacing) * VIEW.camera.pixel_spread * depth);
    vec3 plane = vec3(rate, 1.0 / depth - dot(rate, tangent));
    // the factor converts an exponent of e to one of 2
    float plane_scale = LOG2_E * inversesqrt(dot(plane, plane)) / (0.1 + depth * (0.5 * float(spacing) * VIEW.camera.pixel_spread + 5.0e-4));
    float unit = depth / INVERSE_SCALE;

    // Positions of the taps, clamped to the picture; a clamped tap gets little weight unless its surface is similar.
    ivec2 low = max(pixel - spacing, ivec2(0)), high = min(pixel + spacing, ivec2(VIEW.width, VIEW.height) - 1);
    ivec3 columns = ivec3(low.x, pixel.x, high.x), rows = ivec3(low.y, pixel.y, high.y) * int(VIEW.width);

    // Exponents (base 2) of the taps' surface weights. The guide 0 of a tap without a surface is far from every normal.
    uvec4 taps[8];
    float alike[8];
    vec2 level = of_kinds(unpackHalf2x16(own.x)), variance_sum = of_kinds(unpackHalf2x16(own.z));
    float count = 1.0;
    [[unroll]] for (int i = 0; i < 8; i++) {
        const int at = i < 4 ? i : i + 1;
        const ivec2 offset = ivec2(at % 3, at / 3);
        taps[i] = LightTexels(push.source).at[uint(rows[offset.y] + columns[offset.x])];
        uint other = taps[i].w;
        float expected = 1.0 + dot(depth_gradient, vec2(offset - 1));
        float off_plane = abs(expected - guide_inverse(other) * unit);
        vec3 bend = guide_components(other) - normal;
        const float kernel = (offset.x == 1 ? 0.0 : -1.0) + (offset.y == 1 ? 0.0 : -1.0);
        alike[i] = kernel - off_plane * plane_scale - dot(bend, bend) * NORMAL_SCALE;
        if (NOISY_VARIANCE != 0) {
            float same = exp2(alike[i]);
            variance_sum += of_kinds(unpackHalf2x16(taps[i].z)) * same;
            count += same;
        }
    }
    vec2 variance = variance_sum / count, deviation = sqrt(variance);
    vec2 light_scale = LOG2_E / (LUMINANCE_SIGMA * deviation + 1.0e-3 * level + 1.0e-6);

    // sums of colour codes, weighted by the level
    vec2 level_sum = level, green = level * green_code(own.y), red = level * red_code(own.y);
    vec2 squares = vec2(1.0), total = vec2(1.0);
    [[unroll]] for (int i = 0; i < 8; i++) {
        vec2 other = of_kinds(unpackHalf2x16(taps[i].x));
        vec2 weight = of_kinds(exp2(alike[i] - abs(other - level) * light_scale));
        vec2 light = other * weight;
        total += weight;
        level_sum += light;
        green += light * green_code(taps[i].y);
        red += light * red_code(taps[i].y);
        if (LAST == 0) squares += weight * weight;
    }
    vec2 scale = 1.0 / total;
    LightTexel mean;
    mean.level = level_sum * scale;
    mean.green = (green - CODE_GREY * level_sum) * (CODE_SCALE * scale);
    mean.red = (red - CODE_GREY * level_sum) * (CODE_SCALE * scale);
    if (LAST != 0) {
        vec3 light = light_of_texel(mean.level.x + mean.level.y, mean.green.x + mean.green.y, mean.red.x + mean.red.y);
        light_write(VIEW.images.direct, pixel, light, dither(pixel, DITHER_FILTERED));
        LightTexels(DENOISE.history).at[place].z = imageLoad(uimages_r32ui[DENOISE.past], pixel).x;
        return;
    }
    // the taps have similar surfaces and are taken to have the same variance
    mean.variance = variance * squares * (scale * scale);
    mean.guide = guide;
    LightTexels(push.target).at[place] = pack_texel(mean, dither(pixel, DITHER_FILTERED));
}
