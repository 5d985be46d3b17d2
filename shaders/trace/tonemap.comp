#version 460
// From linear radiance to the picture: exposure, tone curve, display encoding.
//
// The curve is the identity up to KNEE and bends smoothly (its slope is continuous) towards 1 above: radiance 1, the
// white of the classic look, shows as 0.85 of white, and what is brighter still gains.
#include "trace/exposure.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float KNEE = 0.6;

vec3 tone_curve(vec3 x) {
    vec3 shoulder = 1.0 - (1.0 - KNEE) * exp(-(x - KNEE) / (1.0 - KNEE));
    return mix(shoulder, x, lessThan(x, vec3(KNEE)));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= int(VIEW.width) || pixel.y >= int(VIEW.height)) return;
    ivec2 target = pixel + ivec2(VIEW.target_x, VIEW.target_y);
    if (target.x < 0 || target.y < 0 || target.x >= int(VIEW.target_width) || target.y >= int(VIEW.target_height)) return;
    float exposure = ExposureState(VIEW.exposure).exposure * exp2(VIEW.exposure_base + VIEW.exposure_bias);
    vec3 radiance = max(imageLoad(images_rgba32f[VIEW.image_hdr], pixel).rgb * exposure, 0.0);
    imageStore(images_rgba8[VIEW.image_target], target, vec4(encode_display(tone_curve(radiance)), 1.0));
}
