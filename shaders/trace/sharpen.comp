#version 460
// Sharpening of the resolved picture: AMD's robust contrast-adaptive sharpening (FidelityFX Super Resolution 1, 2021).
// A negative lobe of the four nearest neighbours, as strong as leaves the result within the range of display; it works on
// exposed colours that are compressed to that range.
#include "trace/color.glsl"
#include "trace/exposure.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Strongest lobe: beyond it noise is amplified.
const float LOBE_LIMIT = 0.25 - 1.0 / 16.0;

vec3 compressed_at(ivec2 pixel, ivec2 size, float exposure) {
    vec3 c = imageLoad(images_rgba16f[VIEW.antialias.image_resolved], clamp(pixel, ivec2(0), size - 1)).rgb * exposure;
    return c / (1.0 + max_component(c));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(VIEW.antialias.output_width, VIEW.antialias.output_height);
    if (any(greaterThanEqual(pixel, size))) return;
    float exposure = max(ExposureState(VIEW.exposure.state).exposure, 1.0e-3) * exp2(VIEW.exposure.base + VIEW.exposure.bias);
    vec3 middle = compressed_at(pixel, size, exposure);
    vec3 around[4] = vec3[](compressed_at(pixel + ivec2(0, -1), size, exposure), compressed_at(pixel + ivec2(-1, 0), size, exposure),
        compressed_at(pixel + ivec2(1, 0), size, exposure), compressed_at(pixel + ivec2(0, 1), size, exposure));
    vec3 least = min(min(around[0], around[1]), min(around[2], around[3]));
    vec3 most = max(max(around[0], around[1]), max(around[2], around[3]));
    // the lobes at which the result reaches 0 and 1
    vec3 to_black = min(least, middle) / max(4.0 * most, 1.0e-6);
    vec3 to_white = (1.0 - max(most, middle)) / min(4.0 * least - 4.0, -1.0e-6);
    vec3 lobes = max(-to_black, to_white);
    float lobe = clamp(max_component(lobes), -LOBE_LIMIT, 0.0) * VIEW.antialias.sharpness;
    vec3 color = (lobe * (around[0] + around[1] + around[2] + around[3]) + middle) / (4.0 * lobe + 1.0);
    color = max(color, vec3(0.0)) / max(1.0 - max_component(color), 1.0e-3) / exposure;
    imageStore(images_rgba16f[VIEW.antialias.image_picture], pixel, vec4(min(color, vec3(60000.0)), 0.0));
}
