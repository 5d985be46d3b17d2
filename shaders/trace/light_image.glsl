// Images of light: 4 bytes a pixel, three mantissas of nine bits with one exponent.
#ifndef RELIGHT_TRACE_LIGHT_IMAGE_GLSL
#define RELIGHT_TRACE_LIGHT_IMAGE_GLSL

#include "common/bindless.glsl"

// `dither`: uniform in [0, 1) makes the mean over many pixels or frames exact; 0.5 rounds to nearest.
uint pack_light(vec3 light, float dither) {
    light = clamp(light, 0.0, 65000.0); // also replaces NaN by a number
    float largest = max(light.r, max(light.g, light.b));
    int exponent = clamp(int(floatBitsToUint(largest) >> 23) - 127, -16, 15);
    // the largest component becomes 256..511; rounding of 511.x is cut off, an error of at most a thousandth
    float scale = uintBitsToFloat(uint(8 - exponent + 127) << 23);
    // rounds by adding 2^23, whose mantissa counts ones: several times faster than a conversion
    vec3 rounded = clamp(light * scale + (dither - 0.5), 0.0, 511.0) + 8388608.0;
    uvec3 mantissas = floatBitsToUint(rounded) & 511u;
    return mantissas.r | mantissas.g << 9 | mantissas.b << 18 | uint(exponent + 16) << 27;
}

vec3 unpack_light(uint packed) {
    // mantissas as those of floats in [1, 2), minus 1: several times faster than conversions
    float scale = uintBitsToFloat(((packed >> 27) + uint(127 - 16 - 8 + 9)) << 23);
    uvec3 mantissas = uvec3(packed << 14, packed << 5, packed >> 4) & 0x7FC000u | 0x3F800000u;
    return fma(uintBitsToFloat(mantissas), vec3(scale), vec3(-scale));
}

vec3 light_read(uint image, ivec2 pixel) { return unpack_light(imageLoad(uimages_r32ui[image], pixel).x); }

// Replaces NaN, infinities and invalid light by 0: filters and history would spread them over the picture.
vec3 finite_light(vec3 light) {
    const float MOST = 1.0e30;
    return all(lessThan(abs(light), vec3(MOST))) ? light : vec3(0.0);
}

void light_write(uint image, ivec2 pixel, vec3 light, float dither) {
    light = finite_light(light);
    imageStore(uimages_r32ui[image], pixel, uvec4(pack_light(light, dither)));
}

#endif
