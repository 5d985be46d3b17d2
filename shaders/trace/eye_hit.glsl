// What the eye's own rays meet first: written by eye.rgen, read by the passes that go on from there.
#ifndef RELIGHT_TRACE_EYE_HIT_GLSL
#define RELIGHT_TRACE_EYE_HIT_GLSL

#include "trace/geometry.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer EyeHits { uvec4 at[]; };

// The random numbers of a pixel's path begin with those of its ray.
const uint EYE_STREAM = 0;
// What every path sees, and what the eye's own ray sees.
const uint MASK_ALWAYS = MASK_SKY | MASK_NO_SHADOW, EYE_MASK = MASK_SOLID | MASK_ALWAYS;

void eye_hit_write(ivec2 pixel, Hit hit) {
    EyeHits(VIEW.texels).at[place_of(pixel)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.barycentrics));
}

// How far away it is, the point on the triangle tells.
Hit eye_hit_read(ivec2 pixel) {
    uvec4 packed = EyeHits(VIEW.texels).at[place_of(pixel)];
    return Hit(packed.x, packed.y, uintBitsToFloat(packed.zw), 0.0);
}

#endif
