#version 460
// Copies the frame to the window. Applies overbright bits and gamma, which the engine leaves to the gamma ramp, and the
// encoding of the window.
#include "common/bindless.glsl"

// `encoding`: PRESENT_*. `wide`: the frame has half floats, whose values above 1 are brighter than white. `white`: that of
// the display, cd/m2.
layout(push_constant, scalar) uniform Push { uint image; float scale; float inverse_gamma; uint encoding; uint wide; float white; } push;
layout(location = 0) in vec2 in_uv;
layout(location = 0) out vec4 out_color;

const uint PRESENT_PLAIN = 0;
const uint PRESENT_SRGB = 1;
const uint PRESENT_SCRGB = 2;
const uint PRESENT_HDR10 = 3;

// Linear light of display values; 1 is white.
vec3 decoded(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045))); }

// Rec. 709 to Rec. 2020 primaries (ITU-R BT.2087).
const mat3 TO_2020 = mat3(0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0114, 0.8956);

// SMPTE ST 2084 of light in cd/m2.
vec3 perceptual(vec3 light) {
    vec3 p = pow(clamp(light / 10000.0, 0.0, 1.0), vec3(0.1593017578125));
    return pow((0.8359375 + 18.8515625 * p) / (1.0 + 18.6875 * p), vec3(78.84375));
}

void main() {
    ivec2 size = push.wide != 0 ? imageSize(images_rgba16f[push.image]) : imageSize(images_rgba8[push.image]);
    ivec2 texel = min(ivec2(in_uv * vec2(size)), size - 1);
    vec3 c = push.wide != 0 ? max(imageLoad(images_rgba16f[push.image], texel).rgb, 0.0) : imageLoad(images_rgba8[push.image], texel).rgb;
    if (push.inverse_gamma != 1.0) c = pow(c, vec3(push.inverse_gamma));
    c *= push.scale;
    if (push.wide == 0) c = min(c, vec3(1.0));
    // an sRGB target encodes on write and needs linear values
    if (push.encoding == PRESENT_SRGB) c = decoded(c);
    // scRGB: 1 is 80 cd/m2
    if (push.encoding == PRESENT_SCRGB) c = decoded(c) * (push.white / 80.0);
    if (push.encoding == PRESENT_HDR10) c = perceptual(TO_2020 * decoded(c) * push.white);
    out_color = vec4(c, 1.0);
}
