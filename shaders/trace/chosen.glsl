// The light that a pixel sends a ray to: written by choose.comp, read by direct.rgen.
#ifndef RELIGHT_TRACE_CHOSEN_GLSL
#define RELIGHT_TRACE_CHOSEN_GLSL

#include "trace/light_ray.glsl"
#include "trace/ray_order.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ChosenTexels { uvec4 at[]; };

struct Chosen {
    LightSample light;
    ivec2 pixel;
    bool suns; // whether suns may reach the pixel, too
};

// `slot`: see ray_order.glsl; `place`: of the pixel in its tile; `dither`: see pack_light.
void chosen_write(uint slot, uvec2 place, LightSample s, float dither, bool suns) {
    ChosenTexels(VIEW.texels).at[slot] = pack_light_ray(s, place, suns, dither);
}

Chosen chosen_read(uint slot) {
    Chosen chosen;
    uvec2 place;
    chosen.light = unpack_light_ray(ChosenTexels(VIEW.texels).at[slot], place, chosen.suns);
    chosen.pixel = pixel_of_slot(slot, place);
    return chosen;
}

#endif
