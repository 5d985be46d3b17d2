// What the eye's own rays meet first: written by primary_rays.rgen, read by the passes that go on from there.
#ifndef RELIGHT_TRACE_PRIMARY_HIT_GLSL
#define RELIGHT_TRACE_PRIMARY_HIT_GLSL

#include "trace/geometry.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer PrimaryHits { uvec4 at[]; };

// What every path sees, and what the eye's own ray sees.
const uint MASK_ALWAYS = MASK_SKY | MASK_NO_SHADOW, PRIMARY_MASK = MASK_SOLID | MASK_ALWAYS;

// Bits beside the number of the triangle: it is of what only the eye itself sees, and the pixel is finished.
const uint PRIMARY_HIT_FIRST_PERSON = 1u << 31, PRIMARY_HIT_FINISHED = 1u << 30, PRIMARY_HIT_BITS = PRIMARY_HIT_FIRST_PERSON | PRIMARY_HIT_FINISHED;

void primary_hit_write(ivec2 pixel, Hit hit, bool first_person) {
    uint bits = first_person ? PRIMARY_HIT_FIRST_PERSON : 0u;
    PrimaryHits(VIEW.scratch).at[place_of(pixel)] = uvec4(hit.geometry, hit.primitive & ~PRIMARY_HIT_BITS | bits, floatBitsToUint(hit.barycentrics));
}

// How far away it is, the point on the triangle tells.
Hit primary_hit_read(ivec2 pixel, out bool first_person) {
    uvec4 packed = PrimaryHits(VIEW.scratch).at[place_of(pixel)];
    first_person = (packed.y & PRIMARY_HIT_FIRST_PERSON) != 0;
    return Hit(packed.x, packed.y & ~PRIMARY_HIT_BITS, uintBitsToFloat(packed.zw), 0.0);
}

// Whether primary.rgen has told without a ray what the pixel shows.
bool primary_hit_finished(ivec2 pixel) { return (PrimaryHits(VIEW.scratch).at[place_of(pixel)].y & PRIMARY_HIT_FINISHED) != 0; }

void primary_hit_finish(ivec2 pixel) { PrimaryHits(VIEW.scratch).at[place_of(pixel)].y |= PRIMARY_HIT_FINISHED; }

#endif
