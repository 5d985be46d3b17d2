// The light that a pixel sends a ray to: written by choose.comp, read by direct.rgen.
#ifndef RELIGHT_TRACE_CHOSEN_GLSL
#define RELIGHT_TRACE_CHOSEN_GLSL

#include "trace/lights.glsl"
#include "trace/ray_order.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ChosenTexels { uvec4 at[]; };

struct Chosen {
    LightSample light;
    ivec2 pixel;
    bool suns; // whether suns may reach the pixel, too
};

const uint SIGN_BIT = 0x80000000u;

// Directions are kept in 2 x 28 bits, as fine as the numbers that they are computed with: rounded to 2 x 16 bits they make
// rays end at what they ought to pass, and some pictures darker or brighter by a thousandth. The bits below hold the
// pixel's place in its tile. `dither`: see pack_light.
const float DIRECTION_STEPS = 134217727.0;

void chosen_write(uint slot, uvec2 place, LightSample s, float dither, bool suns) {
    // light from nearer than 0 arrives as that from 0 does, so the sign is free
    uint distance = floatBitsToUint(max(s.distance, 0.0)) & ~SIGN_BIT | (suns ? SIGN_BIT : 0u);
    ivec2 direction = ivec2(round(clamp(octahedral(s.direction), -1.0, 1.0) * DIRECTION_STEPS));
    ChosenTexels(VIEW.texels).at[slot] = uvec4(uvec2(direction) << 4 | place, distance, pack_light(sound_light(s.light), dither));
}

Chosen chosen_read(uint slot) {
    uvec4 packed = ChosenTexels(VIEW.texels).at[slot];
    float distance = uintBitsToFloat(packed.z & ~SIGN_BIT);
    vec3 direction = from_octahedral(vec2(ivec2(packed.xy) >> 4) / DIRECTION_STEPS);
    LightSample light = LightSample(direction, distance, unpack_light(packed.w), false);
    return Chosen(light, pixel_of_slot(slot, packed.xy & 15u, VIEW.width), (packed.z & SIGN_BIT) != 0);
}

#endif
