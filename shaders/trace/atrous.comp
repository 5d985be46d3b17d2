#version 460
// An edge-avoiding a-trous wavelet step (Dammertz et al., HPG 2010), guided by normals, the surface's plane and the
// variance of the light (Schied et al. 2017, section 4.3 and 4.4). The kernel is 3 x 3. Direct and indirect light share
// what the surface says and differ in what the light says.
#define OWN_PUSH
#extension GL_EXT_control_flow_attributes : require
#include "trace/denoise.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Whether there is bounced light at all.
layout(constant_id = 0) const uint BOUNCES = 1;
// Whether the variance of a pixel is taken from around it, too: that of fresh light is itself noisy.
layout(constant_id = 1) const uint NOISY_VARIANCE = 1;
// Whether this is the last step, which leaves the sum of both kinds of light where direct light was.
layout(constant_id = 2) const uint LAST = 0;

// Differences of luminance that count as noise, in standard deviations: of direct and indirect light.
const vec2 LUMINANCE_SIGMA = vec2(4.0, 6.0);
const float LOG2_E = 1.44269504;

// The exponents to which normals of guides go with the square of their differences: of normals of unit length those of
// about the 64th power of their cosine; of each component, whose bits are where they are in the guide. That of z has the
// bit of reflections above it, by which one differs from all that is none.
const float NORMAL_SCALE = 0.4528; // root of 32 log2(e) / 15^2
const vec3 COMPONENT_SCALE = NORMAL_SCALE / vec3(1.0, 32.0, 1024.0);
const uvec3 COMPONENTS = uvec3(31u, 31u << 5, 63u << 10);

// The components as they stand in the guide, times one, 32 and 1024.
vec3 components(uint guide) { return uintBitsToFloat(0x4B000000u | guide & COMPONENTS); }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    uint place = place_of(pixel);
    uvec4 packed = LightTexels(push.source).at[place];
    LightTexel middle = unpack_texel(packed);
    if (middle.guide == 0) {
        if (LAST == 0) LightTexels(push.target).at[place] = uvec4(0);
        return;
    }
    int spacing = int(push.spacing);
    vec3 normal = components(middle.guide);
    float depth = guide_depth(middle.guide);
    vec2 slope = imageLoad(images_rg16f[DENOISE.slope], pixel).xy * float(spacing);
    vec2 value = vec2(luminance(middle.direct), luminance(middle.indirect));

    // the plane in camera space: its point at tangent (x, y) has the inverse depth a x + b y + c
    vec2 tangent = tangent_of(vec2(pixel));
    vec2 rate = -slope / (float(spacing) * VIEW.pixel_spread * depth);
    vec3 plane = vec3(rate, 1.0 / depth - dot(rate, tangent));
    // the logarithm makes a power of e one of 2
    float plane_scale = LOG2_E * inversesqrt(dot(plane, plane)) / (0.1 + depth * (0.5 * float(spacing) * VIEW.pixel_spread + 5.0e-4));
    float unit = depth / INVERSE_SCALE;

    // Places of the taps. Beyond the edge of the picture they are on it, and weigh little unless they are alike.
    ivec2 low = max(pixel - spacing, ivec2(0)), high = min(pixel + spacing, ivec2(VIEW.width, VIEW.height) - 1);
    ivec3 columns = ivec3(low.x, pixel.x, high.x), rows = ivec3(low.y, pixel.y, high.y) * int(VIEW.width);

    // How much of the same surface a tap is, as a power of 2. A tap that has nothing to light is far from every normal.
    uvec4 taps[8];
    float alike[8];
    vec2 variance_sum = middle.variance * 4.0;
    float count = 4.0;
    [[unroll]] for (int i = 0; i < 8; i++) {
        const int at = i < 4 ? i : i + 1;
        const ivec2 offset = ivec2(at % 3, at / 3);
        taps[i] = LightTexels(push.source).at[uint(rows[offset.y] + columns[offset.x])];
        uint guide = taps[i].w;
        float expected = 1.0 + dot(slope, vec2(offset - 1));
        float off_plane = abs(expected - guide_inverse(guide) * unit);
        vec3 bend = (components(guide) - normal) * COMPONENT_SCALE;
        alike[i] = -off_plane * plane_scale - dot(bend, bend) + (offset.x == 1 ? 1.0 : 0.0) + (offset.y == 1 ? 1.0 : 0.0);
        if (NOISY_VARIANCE != 0) {
            float same = exp2(alike[i]);
            variance_sum += unpackHalf2x16(taps[i].z) * same;
            count += same;
        }
    }
    vec2 deviation = sqrt(variance_sum / count);
    vec2 light_scale = LOG2_E / (LUMINANCE_SIGMA * deviation + 1.0e-3 * value + 1.0e-6);

    vec3 direct = middle.direct * 4.0, indirect = middle.indirect * 4.0;
    vec2 variance = middle.variance * 16.0, total = vec2(4.0);
    [[unroll]] for (int i = 0; i < 8; i++) {
        vec3 tap_direct = unpack_light(taps[i].x);
        vec2 weight = vec2(exp2(alike[i] - abs(luminance(tap_direct) - value.x) * light_scale.x), 0.0);
        direct += tap_direct * weight.x;
        if (BOUNCES != 0) {
            vec3 tap_indirect = unpack_light(taps[i].y);
            weight.y = exp2(alike[i] - abs(luminance(tap_indirect) - value.y) * light_scale.y);
            indirect += tap_indirect * weight.y;
        }
        if (LAST == 0) variance += unpackHalf2x16(taps[i].z) * weight * weight;
        total += weight;
    }
    middle.direct = direct / total.x;
    middle.indirect = indirect / total.y;
    if (LAST != 0) {
        light_write(VIEW.image_direct, pixel, middle.direct + middle.indirect, dither(pixel, 2));
        return;
    }
    middle.variance = variance / (total * total);
    LightTexels(push.target).at[place] = pack_texel(middle, dither(pixel, 2));
}
