// The light that a pixel sends a ray to: written by choose.comp, read by direct.rgen.
#ifndef RELIGHT_TRACE_CHOSEN_GLSL
#define RELIGHT_TRACE_CHOSEN_GLSL

#include "trace/lights.glsl"
#include "trace/gbuffer.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ChosenTexels { uvec4 at[]; };

struct Chosen {
    LightSample light;
    uint suns; // how many may reach the pixel, too
};

// `dither`: see pack_light.
void chosen_write(ivec2 pixel, LightSample s, float dither, uint suns) {
    ChosenTexels(VIEW.texels).at[place_of(pixel)] =
        uvec4(pack_normal(s.direction), floatBitsToUint(s.distance), pack_light(sound_light(s.light), dither), suns);
}

Chosen chosen_read(ivec2 pixel) {
    uvec4 packed = ChosenTexels(VIEW.texels).at[place_of(pixel)];
    return Chosen(LightSample(unpack_normal(packed.x), uintBitsToFloat(packed.y), unpack_light(packed.z), false), packed.w);
}

#endif
