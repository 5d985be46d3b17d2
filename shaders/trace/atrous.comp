#version 460
// Second half of the denoiser: an edge-avoiding a-trous wavelet step (Dammertz et al., HPG 2010), guided by normals,
// the surface's plane and the variance of the light (Schied et al. 2017, section 4.3 and 4.4). The kernel is 3x3.
#define OWN_PUSH
#include "trace/color.glsl"
#include "trace/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

bool inside(ivec2 pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < int(VIEW.width) && pixel.y < int(VIEW.height);
}

const float NORMAL_POWER = 64.0, LUMINANCE_SIGMA = 4.0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    vec4 middle = imageLoad(images_rgba16f[push.source], pixel);
    vec4 position = imageLoad(images_rgba32f[VIEW.image_position], pixel);
    if (position.w < 0.0) {
        imageStore(images_rgba16f[push.target], pixel, vec4(0.0));
        return;
    }
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.image_surface], pixel).xy;
    vec3 face_normal = unpack_normal(surface.x), normal = unpack_normal(surface.y);
    float value = luminance(middle.rgb);
    // the variance itself is noisy: blurred a little
    float blurred = 0.0, blur_weight = 0.0;
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            ivec2 tap = pixel + ivec2(x, y);
            if (!inside(tap)) continue;
            float weight = (x == 0 ? 2.0 : 1.0) * (y == 0 ? 2.0 : 1.0);
            blurred += imageLoad(images_rgba16f[push.source], tap).a * weight;
            blur_weight += weight;
        }
    }
    float light_scale = 1.0 / (LUMINANCE_SIGMA * sqrt(max(blurred / blur_weight, 0.0)) + 1.0e-3 * value + 1.0e-6);
    float plane_scale = 1.0 / (0.1 + 0.5 * float(push.spacing) * position.w * VIEW.pixel_spread);

    vec3 sum = middle.rgb * 4.0;
    float variance = middle.a * 16.0, total = 4.0;
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            if (x == 0 && y == 0) continue;
            ivec2 tap = pixel + ivec2(x, y) * int(push.spacing);
            if (!inside(tap)) continue;
            vec4 tap_position = imageLoad(images_rgba32f[VIEW.image_position], tap);
            if (tap_position.w < 0.0) continue;
            vec4 light = imageLoad(images_rgba16f[push.source], tap);
            vec3 tap_normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.image_surface], tap).y);
            float weight = (x == 0 ? 2.0 : 1.0) * (y == 0 ? 2.0 : 1.0);
            weight *= pow(max(dot(normal, tap_normal), 0.0), NORMAL_POWER);
            weight *= exp(-abs(dot(tap_position.xyz - position.xyz, face_normal)) * plane_scale
                - abs(luminance(light.rgb) - value) * light_scale);
            sum += light.rgb * weight;
            variance += light.a * weight * weight;
            total += weight;
        }
    }
    imageStore(images_rgba16f[push.target], pixel, vec4(sum / total, min(variance / (total * total), 60000.0)));
}
