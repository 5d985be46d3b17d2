// Bloom: a part of the light is spread around where it comes from, as by the lens of an eye or a camera. Nothing is added
// and there is no threshold: what a pixel loses its surroundings gain (but for the picture's edges).
//
// The picture is averaged into levels of 4, 8, 16, 32 and 64 pixels; the spread light is the mean of the levels, each
// smoothed by a cubic B-spline. Equal light for each doubling of the distance is about what an eye spreads (Spencer et
// al., Physically-Based Glare Effects for Digital Images, SIGGRAPH 1995: glare falls with about the square of the angle).
#ifndef RELIGHT_TRACE_BLOOM_GLSL
#define RELIGHT_TRACE_BLOOM_GLSL

#include "trace/picture.glsl"

// Texels of all levels, then the sum of them as large as the first level; four halves each.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer BloomTexels { uvec2 at[]; };

// Texels of a level; the last row and column may lie half outside of the picture.
ivec2 bloom_size(uint level) {
    ivec2 picture = picture_size();
    int pixels = int(BLOOM_FIRST << level);
    return (picture + pixels - 1) / pixels;
}

// First texel of a level; of the sum with BLOOM_LEVELS.
uint bloom_start(uint level) {
    uint start = 0;
    for (uint i = 0; i < level; i++) {
        ivec2 size = bloom_size(i);
        start += uint(size.x * size.y);
    }
    return start;
}

uvec2 bloom_pack(vec3 light) {
    light = min(light, vec3(60000.0));
    return uvec2(packHalf2x16(light.rg), packHalf2x16(vec2(light.b, 0.0)));
}

vec3 bloom_read(uint start, ivec2 size, ivec2 place) {
    place = clamp(place, ivec2(0), size - 1);
    uvec2 texel = BloomTexels(VIEW.post.bloom).at[start + uint(place.y * size.x + place.x)];
    return vec3(unpackHalf2x16(texel.x), unpackHalf2x16(texel.y).x);
}

#endif
