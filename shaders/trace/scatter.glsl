// The cheap filter's texel: 8 bytes with the light, which is not told apart here, depth, a normal of 2 x 6 bits and the
// number of frames, up to 15.
#ifndef RELIGHT_TRACE_SCATTER_GLSL
#define RELIGHT_TRACE_SCATTER_GLSL

#include "trace/denoise.glsl"

struct SparseTexel {
    vec3 light;
    uint guide; // 0: nothing to light
};

const uint SPARSE_FRAMES = 15;

uint pack_sparse_guide(float depth, vec3 normal, uint frames) {
    uint guide = pack_guide(depth, normal);
    // of the two bytes of the normal the upper six bits
    return guide & 0xFFFFu | (guide >> 18 & 0x3Fu) << 16 | (guide >> 26 & 0x3Fu) << 22 | min(frames, SPARSE_FRAMES) << 28;
}

float sparse_depth(uint guide) { return guide_depth(guide); }
vec3 sparse_normal(uint guide) { return guide_normal((guide >> 16 & 0x3Fu) << 18 | (guide >> 22 & 0x3Fu) << 26); }
float sparse_frames(uint guide) { return float(guide >> 28); }

SparseTexel sparse_read(uint image, ivec2 pixel) {
    uvec2 t = imageLoad(uimages_rg32ui[image], pixel).xy;
    return SparseTexel(unpack_light(t.x), t.y);
}

void sparse_write(uint image, ivec2 pixel, SparseTexel t, float dither) {
    imageStore(uimages_rg32ui[image], pixel, uvec4(pack_light(t.light, dither), t.guide, 0, 0));
}

#endif
