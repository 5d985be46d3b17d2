#version 460
// Copies the frame to the window. Applies overbright bits and gamma, which the engine leaves to the gamma ramp.
#include "common/bindless.glsl"

layout(push_constant, scalar) uniform Push { uint image; float scale; float inverse_gamma; uint srgb_target; } push;
layout(location = 0) in vec2 in_uv;
layout(location = 0) out vec4 out_color;

void main() {
    ivec2 size = imageSize(images_rgba8[push.image]);
    vec3 c = imageLoad(images_rgba8[push.image], min(ivec2(in_uv * vec2(size)), size - 1)).rgb;
    if (push.inverse_gamma != 1.0) c = pow(c, vec3(push.inverse_gamma));
    c = min(c * push.scale, vec3(1.0));
    // an sRGB target encodes on write and needs linear values
    if (push.srgb_target != 0) c = mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
    out_color = vec4(c, 1.0);
}
