// Texel of the sparse filter, 8 bytes: the sum of direct and indirect light; depth, with the reflection bit in place of
// its sign; a normal of 2 x 6 bits; the number of frames, up to 15.
#ifndef RELIGHT_TRACE_SPARSE_FILTER_GLSL
#define RELIGHT_TRACE_SPARSE_FILTER_GLSL

#include "trace/denoise.glsl"

struct SparseTexel {
    vec3 light;
    uint guide; // 0: no surface
};

const uint SPARSE_FRAMES = 15;

uint pack_sparse_guide(float depth, vec3 normal, bool reflection, uint frames) {
    uvec2 n = uvec2(round((unpackSnorm2x16(pack_normal(normal)) * 0.5 + 0.5) * 63.0));
    return pack_depth(depth) | (reflection ? REFLECTION_BIT : 0u) | n.x << 16 | n.y << 22 | min(frames, SPARSE_FRAMES) << 28;
}

float sparse_depth(uint guide) { return unpack_depth(guide & 0x7FFFu); }
vec3 sparse_normal(uint guide) {
    return unpack_normal(packSnorm2x16(vec2(guide >> 16 & 63u, guide >> 22 & 63u) * (2.0 / 63.0) - 1.0));
}
float sparse_frames(uint guide) { return float(guide >> 28); }

SparseTexel sparse_read(uint64_t texels, ivec2 pixel) {
    uvec2 t = SparseTexels(texels).at[place_of(pixel)];
    return SparseTexel(unpack_light(t.x), t.y);
}

void sparse_write(uint64_t texels, ivec2 pixel, SparseTexel t, float dither) {
    SparseTexels(texels).at[place_of(pixel)] = uvec2(pack_light(t.light, dither), t.guide);
}

#endif
