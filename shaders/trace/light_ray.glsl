// A shadow ray to a light in 16 bytes, passed from one pass to the next.
#ifndef RELIGHT_TRACE_LIGHT_RAY_GLSL
#define RELIGHT_TRACE_LIGHT_RAY_GLSL

#include "trace/direction.glsl"
#include "trace/lights.glsl"
#include "trace/light_image.glsl"

const uint SIGN_BIT = 0x80000000u;

// `spare`: two numbers below 256; `flag`: stored in place of `sky`; `dither`: see `pack_light`.
uvec4 pack_light_ray(LightSample s, uvec2 spare, bool flag, float dither) {
    // the sign is free: a negative distance has the effect of 0
    uint distance = floatBitsToUint(max(s.distance, 0.0)) & ~SIGN_BIT | (flag ? SIGN_BIT : 0u);
    return uvec4(pack_direction(s.direction, spare), distance, pack_light(finite_light(s.light), dither));
}

bool flag_of_light_ray(uvec4 packed) { return (packed.z & SIGN_BIT) != 0; }

LightSample unpack_light_ray(uvec4 packed, out uvec2 spare, out bool flag) {
    spare = spare_of_direction(packed.xy);
    flag = flag_of_light_ray(packed);
    return LightSample(unpack_direction(packed.xy), uintBitsToFloat(packed.z & ~SIGN_BIT), unpack_light(packed.w), false);
}

#endif
