// The light that a pixel sends a ray to: written by choose.comp, read by direct.rgen.
#ifndef RELIGHT_TRACE_CHOSEN_GLSL
#define RELIGHT_TRACE_CHOSEN_GLSL

#include "trace/lights.glsl"
#include "trace/gbuffer.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ChosenTexels { uvec4 at[]; };

struct Chosen {
    LightSample light;
    bool suns; // whether suns may reach the pixel, too
};

const uint SIGN_BIT = 0x80000000u;

// The direction is kept as it is: rounded to 2 x 16 bits it makes rays end at what they ought to pass, and some pictures
// darker or brighter by a thousandth. `dither`: see pack_light.
void chosen_write(ivec2 pixel, LightSample s, float dither, bool suns) {
    // light from nearer than 0 arrives as that from 0 does, so the sign is free
    uint distance = floatBitsToUint(max(s.distance, 0.0)) & ~SIGN_BIT | (suns ? SIGN_BIT : 0u);
    ChosenTexels(VIEW.texels).at[place_of(pixel)] =
        uvec4(floatBitsToUint(octahedral(s.direction)), distance, pack_light(sound_light(s.light), dither));
}

Chosen chosen_read(ivec2 pixel) {
    uvec4 packed = ChosenTexels(VIEW.texels).at[place_of(pixel)];
    float distance = uintBitsToFloat(packed.z & ~SIGN_BIT);
    LightSample light = LightSample(from_octahedral(uintBitsToFloat(packed.xy)), distance, unpack_light(packed.w), false);
    return Chosen(light, (packed.z & SIGN_BIT) != 0);
}

#endif
