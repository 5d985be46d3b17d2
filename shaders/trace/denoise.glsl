// Shared by the denoiser's passes: packed texels, and the position of a pixel in the last frame.
//
// A pixel's light and its guide (depth and normal, which decide whether two pixels are similar) are one texel of 16
// bytes, so that a filter tap is one read. Texels are in buffers, row by row: texture units read images of 16-byte
// texels at a quarter of the rate of narrow ones; buffers are limited by bandwidth only.
#ifndef RELIGHT_TRACE_DENOISE_GLSL
#define RELIGHT_TRACE_DENOISE_GLSL

#include "trace/color.glsl"
#include "trace/gbuffer.glsl"
#include "trace/light_image.glsl"

#define DENOISE VIEW.denoise

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer LightTexels { uvec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer SparseTexels { uvec2 at[]; };
// Of each stratum: change and size of direct light, of indirect light, as 16-bit floats.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer GradientSums { uvec2 at[]; };

// Edge of a stratum in pixels: each stratum has one gradient sample (Schied et al. 2018, section 4.2).
const int STRATUM = 3;

bool inside(ivec2 pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < int(VIEW.width) && pixel.y < int(VIEW.height);
}

// Index of a stratum in buffers.
uint stratum_place(ivec2 stratum) { return uint(stratum.y * ((int(VIEW.width) + STRATUM - 1) / STRATUM) + stratum.x); }

// A number in [0, 1), different for each pixel, frame and `stream` (`DITHER_*`).
float dither(ivec2 pixel, uint stream) {
    uint x = uint(pixel.x) * 0x9E3779B1u ^ uint(pixel.y) * 0x85EBCA77u ^ (VIEW.seed * 64u + stream) * 0xC2B2AE3Du;
    x ^= x >> 15;
    x *= 0x2C1B3C6Du;
    x ^= x >> 12;
    x *= 0x297A2D39u;
    return float(x >> 8) * (1.0 / 16777216.0);
}

// The guide of a pixel, 32 bits. High half: inverse depth as half float, which is linear on a plane and exact to 0.05
// %. Low half: normal of 3 x 5 bits, compared without unpacking, and above it the reflection bit, set where the pixel
// shows a reflection that alternates with refraction: both may show parallel walls in different light. It is the
// highest bit of the normal's z, so that comparing normals compares it too. 0: no surface.
const float NEAREST_DEPTH = 1.0e-3, FARTHEST_DEPTH = 60000.0;
// Keeps the inverse of every depth within the normal range of 16-bit floats.
const float INVERSE_SCALE = 32.0;

uint pack_depth(float depth) { return packHalf2x16(vec2(INVERSE_SCALE / clamp(depth, NEAREST_DEPTH, FARTHEST_DEPTH), 0.0)); }

const uint REFLECTION_BIT = 1u << 15;

uint pack_guide(float depth, vec3 normal, bool reflection) {
    uvec3 n = uvec3(round(clamp(normal, -1.0, 1.0) * 15.0) + 16.0);
    return pack_depth(depth) << 16 | (reflection ? REFLECTION_BIT : 0u) | n.z << 10 | n.y << 5 | n.x;
}

// Converts a small integer to float: places its bits in the mantissa of 2^23, several times faster than a conversion.
float small_float(uint number) { return uintBitsToFloat(0x4B000000u | number) - 8388608.0; }

float unpack_depth(uint code) { return INVERSE_SCALE / unpackHalf2x16(code).x; }

// Inverse depth, times `INVERSE_SCALE`.
float guide_inverse(uint guide) { return unpackHalf2x16(guide).y; }

float guide_depth(uint guide) { return INVERSE_SCALE / guide_inverse(guide); }

// Difference of the logarithms (base 2) of two depths.
float depth_change(uint guide, uint other) { return log2(guide_inverse(guide) / guide_inverse(other)); }

// Normal of the guide; its length is about 1.
vec3 guide_normal(uint guide) {
    return vec3(small_float(guide & 31u), small_float(guide >> 5 & 31u), small_float(guide >> 10 & 31u)) * (1.0 / 15.0) - 16.0 / 15.0;
}

// Normal and reflection bit for comparison: three integers, each in the mantissa of a float whose unit in the last
// place matches the position of the field in the guide. For unit normals the scale is 15.
const uvec3 COMPONENTS = uvec3(31u, 31u << 5, 63u << 10), COMPONENT_BASE = uvec3(0x4B000000u, 0x48800000u, 0x46000000u);
// Value of a zero in each component.
const vec3 COMPONENT_ZERO = vec3(8388608.0, 262144.0, 8192.0);
vec3 guide_components(uint guide) { return uintBitsToFloat(guide & COMPONENTS | COMPONENT_BASE); }

// History of a pixel, 32 bits: number of frames of direct and indirect light, and the variance of one frame's luminance
// as logarithm in steps of 1/4.
const float VARIANCE_STEP = 0.25, VARIANCE_FIRST = -32.0;

// `random`: one number for each rounding, so that slow changes are not lost.
uint pack_past(vec2 frames, vec2 variance, vec4 random) {
    vec2 codes = (log2(max(variance, 1.0e-12)) - VARIANCE_FIRST) / VARIANCE_STEP;
    uvec4 bytes = uvec4(clamp(vec4(frames, codes) + random, 0.0, 255.0));
    return bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24;
}

vec2 past_frames(uint past) { return vec2(past & 0xFFu, past >> 8 & 0xFFu); }

vec2 past_variance(uint past) { return exp2(vec2(past >> 16 & 0xFFu, past >> 24) * VARIANCE_STEP + VARIANCE_FIRST); }

// A texel of the filter. Each kind of light has a level (r/4 + g/2 + b/4), green minus level, and red minus blue, both
// at most as large as the level. Direct light is x, indirect light y.
struct LightTexel {
    vec2 level;
    vec2 green;
    vec2 red;
    vec2 variance; // of the mean levels
    uint guide;
};

vec3 texel_of(vec3 light) {
    float green = 0.5 * light.g, rest = 0.25 * (light.r + light.b);
    return vec3(green + rest, green - rest, 0.25 * (light.r - light.b));
}

vec3 light_of_texel(float level, float green, float red) {
    float rest = level - green;
    return vec3(rest + 2.0 * red, level + green, rest - 2.0 * red);
}

const float MOST_LEVEL = 16000.0;

// Colours divided by the level, as bytes with 128 for grey: even bytes and odd bytes.
const uint CODES = 0x00FF00FFu, CODE_BASE = 0x64006400u; // 16-bit floats step by 1 from 1024 on

const float CODE_GREY = 1024.0 + 128.0, CODE_SCALE = 1.0 / 127.0;

vec2 green_code(uint codes) { return unpackHalf2x16(codes & CODES | CODE_BASE); }
vec2 red_code(uint codes) { return unpackHalf2x16(codes >> 8 & CODES | CODE_BASE); }

// `dither`: uniform in [0, 1); makes the mean over many frames exact.
uvec4 pack_texel(LightTexel t, float dither) {
    dither -= 0.5;
    vec2 level = clamp(t.level, 0.0, MOST_LEVEL);
    // unit in the last place of a half
    vec2 digit = uintBitsToFloat(floatBitsToUint(level) & 0x7F800000u) * (1.0 / 1024.0);
    vec2 scale = 127.0 / max(level, 1.0e-6);
    // rounds by adding 2^23, as in `pack_light`
    uvec4 codes = floatBitsToUint(clamp(vec4(t.green, t.red) * scale.xyxy + (128.0 + dither), 0.0, 255.0) + 8388608.0) & 0xFFu;
    return uvec4(packHalf2x16(level + digit * dither), codes.x | codes.z << 8 | codes.y << 16 | codes.w << 24,
        packHalf2x16(min(t.variance, vec2(60000.0))), t.guide);
}

// Coordinates of a pixel's centre on the plane at distance 1, to the left and up.
vec2 tangent_of(vec2 pixel) {
    vec2 ndc = 1.0 - (pixel + 0.5) / vec2(VIEW.width, VIEW.height) * 2.0;
    ndc.x -= VIEW.camera.stereo_shift;
    return ndc * vec2(length(VIEW.camera.left), length(VIEW.camera.up));
}

// Depth of the point at `view_distance` on the ray through a pixel. In mirrors: depth of the mirror image.
float depth_of(ivec2 pixel, float view_distance) {
    vec2 t = tangent_of(vec2(pixel));
    return view_distance * inversesqrt(1.0 + dot(t, t));
}

// Position of the pixel's surface in the last frame.
struct LastPixel {
    vec2 pixel;  // centre of the first pixel: 0, 0
    float depth; // negative: unknown, or outside of the picture
};

LastPixel last_pixel_of(ivec2 pixel) {
    vec4 motion = imageLoad(images_rgba16f[VIEW.images.motion], pixel);
    LastPixel last = LastPixel(vec2(pixel) + motion.xy, -1.0);
    if (motion.z >= 0.0) {
        vec2 t = tangent_of(last.pixel);
        last.depth = motion.z * inversesqrt(1.0 + dot(t, t));
    }
    return last;
}

// Light of the picture: both kinds; the denoiser writes their sum to the image of direct light.
vec3 light_of(ivec2 pixel) {
    vec3 light = light_read(VIEW.images.direct, pixel);
    return (VIEW.flags & VIEW_DENOISE) != 0 ? light : light + light_read(VIEW.images.indirect, pixel);
}

#endif
