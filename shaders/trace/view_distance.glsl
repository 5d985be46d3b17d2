// View distance: length of the path from the camera to the surface that a pixel shows. Two images hold it, exactly: a
// half float, which the next frame reads too, and the bits of the mantissa that it lacks, with flags.
#ifndef RELIGHT_TRACE_VIEW_DISTANCE_GLSL
#define RELIGHT_TRACE_VIEW_DISTANCE_GLSL

#include "trace/view.glsl"

// View distance of the sky: beyond every map, within half floats.
const float SKY_DISTANCE = 60000.0;
// Least view distance that is stored: the least half float with a full mantissa.
const float LEAST_DISTANCE = 1.0 / 16384.0;

// Bits of a float's mantissa that a half float lacks; the pixel shows a lit surface; it belongs to the first-person view;
// the half float is the next above the distance.
const uint TAIL_BITS = 0x1FFFu, TAIL_LIT = 1u << 13, TAIL_FIRST_PERSON = 1u << 14, TAIL_ABOVE = 1u << 15;

float stored_distance(float view_distance) { return clamp(view_distance, LEAST_DISTANCE, SKY_DISTANCE); }

// The nearest half float, ties to even. Rounded here because drivers may round or truncate when they store to an R16F
// image, and equal distances of two frames must be stored as equal numbers.
uint half_bits(uint bits) { return bits + 0xFFFu + (bits >> 13 & 1u) & ~TAIL_BITS; }
float as_half(float v) { return uintBitsToFloat(half_bits(floatBitsToUint(v))); }

// `rests`: the surface does not move in the picture.
void view_distance_write(ivec2 pixel, float view_distance, bool rests, bool is_lit, bool first_person) {
    uint bits = floatBitsToUint(stored_distance(view_distance));
    uint rounded = half_bits(bits);
    float head = uintBitsToFloat(rounded);
    imageStore(images_r16f[VIEW.motion.view_distance], pixel, vec4(rests ? head : -head));
    uint tail = bits & TAIL_BITS | (rounded > bits ? TAIL_ABOVE : 0u) | (is_lit ? TAIL_LIT : 0u) | (first_person ? TAIL_FIRST_PERSON : 0u);
    imageStore(uimages_r16ui[VIEW.images.distance_tail], pixel, uvec4(tail));
}

uint distance_tail_read(ivec2 pixel) { return imageLoad(uimages_r16ui[VIEW.images.distance_tail], pixel).x; }

// Whether the pixel shows a lit surface.
bool is_lit_read(ivec2 pixel) { return (distance_tail_read(pixel) & TAIL_LIT) != 0; }

// View distance of the lit surface; -1: none. `tail`: that of the pixel.
float lit_distance_read(ivec2 pixel, uint tail) {
    uint head = floatBitsToUint(abs(imageLoad(images_r16f[VIEW.motion.view_distance], pixel).x));
    if ((tail & TAIL_ABOVE) != 0) head -= TAIL_BITS + 1u;
    return (tail & TAIL_LIT) != 0 ? uintBitsToFloat(head | tail & TAIL_BITS) : -1.0;
}

// Rounded view distance of whatever the pixel shows; `SKY_DISTANCE`: the sky.
float view_distance_read(ivec2 pixel) { return abs(imageLoad(images_r16f[VIEW.motion.view_distance], pixel).x); }

// Rounded view distance in the last frame; negative if the surface moved in the picture then.
float last_view_distance_read(ivec2 pixel) { return imageLoad(images_r16f[VIEW.motion.last_view_distance], pixel).x; }

#endif
