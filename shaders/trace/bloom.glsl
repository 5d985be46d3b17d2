// Bloom: spreads a part of the light around its source, as the lens of an eye or a camera does. It conserves energy
// (except at the picture's edges) and has no threshold.
//
// The picture is averaged into levels of 4, 8, 16, 32 and 64 pixels; the spread light is the mean of the levels, each
// smoothed by a cubic B-spline. Equal light for each doubling of the distance is close to the glare of the human eye
// (Spencer et al., Physically-Based Glare Effects for Digital Images, SIGGRAPH 1995: glare falls with about the square
// of the angle).
#ifndef RELIGHT_TRACE_BLOOM_GLSL
#define RELIGHT_TRACE_BLOOM_GLSL

#include "trace/picture.glsl"

// Texels of all levels, followed by their sum at the size of the first level; four 16-bit floats each.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer BloomTexels { uvec2 at[]; };

// Size of a level, texels; the last row and column may lie partly outside of the picture.
ivec2 bloom_size(uint level) {
    ivec2 picture = picture_size();
    int pixels = int(BLOOM_FIRST << level);
    return (picture + pixels - 1) / pixels;
}

// First texel of a level; `BLOOM_LEVELS`: of the sum.
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
