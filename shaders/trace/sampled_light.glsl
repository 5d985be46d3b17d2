// The sampled light of a pixel: written by `sample_lights.comp`, read by `direct.rgen`.
#ifndef RELIGHT_TRACE_SAMPLED_LIGHT_GLSL
#define RELIGHT_TRACE_SAMPLED_LIGHT_GLSL

#include "trace/light_ray.glsl"
#include "trace/ray_order.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SampledLightTexels { uvec4 at[]; };

struct SampledLight {
    LightSample light;
    ivec2 pixel;
};

// `slot`: see `ray_order.glsl`; `place`: of the pixel in its tile; `sun_place`: of the pixel with the same number among
// those that also trace a ray to a sun, or NO_PLACE; `dither`: see `pack_light`.
void sampled_light_write(uint slot, uvec2 place, uvec2 sun_place, LightSample s, float dither) {
    bool sun = sun_place != NO_PLACE;
    SampledLightTexels(VIEW.scratch).at[slot] = pack_light_ray(s, place | (sun ? sun_place << 4 : uvec2(0)), sun, dither);
}

SampledLight sampled_light_read(uint slot) {
    SampledLight sampled;
    uvec2 spare;
    bool sun;
    sampled.light = unpack_light_ray(SampledLightTexels(VIEW.scratch).at[slot], spare, sun);
    sampled.pixel = pixel_of_slot(slot, spare & 15u);
    return sampled;
}

// Whether a pixel with this number traces a ray to a sun, and its position.
bool samples_sun(uint slot, out ivec2 pixel) {
    uvec4 packed = SampledLightTexels(VIEW.scratch).at[slot];
    pixel = pixel_of_slot(slot, spare_of_direction(packed.xy) >> 4);
    return flag_of_light_ray(packed);
}

#endif
