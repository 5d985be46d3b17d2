// First hits of primary rays: written by `primary_rays.rgen`, read by the passes that continue from them.
#ifndef RELIGHT_TRACE_PRIMARY_HIT_GLSL
#define RELIGHT_TRACE_PRIMARY_HIT_GLSL

#include "trace/geometry.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer PrimaryHits { uvec4 at[]; };

// Masks: geometry visible to every path, and to the first segment of primary rays.
const uint MASK_ALWAYS = MASK_SKY | MASK_NO_SHADOW, PRIMARY_MASK = MASK_SOLID | MASK_ALWAYS;

// Bits beside the triangle's index: the hit is of first-person geometry; the pixel is finished.
const uint PRIMARY_HIT_FIRST_PERSON = 1u << 31, PRIMARY_HIT_FINISHED = 1u << 30, PRIMARY_HIT_BITS = PRIMARY_HIT_FIRST_PERSON | PRIMARY_HIT_FINISHED;

void primary_hit_write(ivec2 pixel, Hit hit, bool first_person) {
    uint bits = first_person ? PRIMARY_HIT_FIRST_PERSON : 0u;
    PrimaryHits(VIEW.scratch).at[place_of(pixel)] = uvec4(hit.geometry, hit.primitive & ~PRIMARY_HIT_BITS | bits, floatBitsToUint(hit.barycentrics));
}

// The distance is not stored; it follows from the point on the triangle.
Hit primary_hit_read(ivec2 pixel, out bool first_person) {
    uvec4 packed = PrimaryHits(VIEW.scratch).at[place_of(pixel)];
    first_person = (packed.y & PRIMARY_HIT_FIRST_PERSON) != 0;
    return Hit(packed.x, packed.y & ~PRIMARY_HIT_BITS, uintBitsToFloat(packed.zw), 0.0);
}

// Whether `primary.rgen` has resolved the pixel without rays.
bool primary_hit_finished(ivec2 pixel) { return (PrimaryHits(VIEW.scratch).at[place_of(pixel)].y & PRIMARY_HIT_FINISHED) != 0; }

void primary_hit_finish(ivec2 pixel) { PrimaryHits(VIEW.scratch).at[place_of(pixel)].y |= PRIMARY_HIT_FINISHED; }

#endif
