#version 460
// Bounced light of the pixels that it was not gathered for: the mean of the four beside them that lie on the same
// surface. Bounced light changes slowly over a surface, and the denoiser smooths it over far more than a pixel.
#include "trace/sparse.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = skipped_pixel(ivec2(gl_GlobalInvocationID.xy));
    if (pixel.x >= int(VIEW.width) || pixel.y >= int(VIEW.height)) return;
    vec4 position = imageLoad(images_rgba32f[VIEW.image_position], pixel);
    vec3 light = vec3(0.0);
    if (position.w >= 0.0) {
        vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.image_surface], pixel).x);
        float tolerance = 0.1 + 4.0 * position.w * VIEW.pixel_spread;
        // where no neighbour fits, as on a wire, what is nearest around is better than black
        vec3 any_light = vec3(0.0);
        float weight = 0.0, any_weight = 0.0;
        const ivec2 beside[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));
        for (int i = 0; i < 4; i++) {
            ivec2 tap = pixel + beside[i];
            if (any(lessThan(tap, ivec2(0))) || tap.x >= int(VIEW.width) || tap.y >= int(VIEW.height)) continue;
            // a gradient sample has taken its turn
            if (!is_gathered(tap)) continue;
            vec4 other = imageLoad(images_rgba32f[VIEW.image_position], tap);
            if (other.w < 0.0) continue;
            vec3 found = light_read(VIEW.image_indirect, tap);
            any_light += found;
            any_weight += 1.0;
            vec3 other_normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.image_surface], tap).x);
            if (dot(normal, other_normal) < 0.9 || abs(dot(other.xyz - position.xyz, normal)) > tolerance) continue;
            light += found;
            weight += 1.0;
        }
        if (weight > 0.0) light /= weight;
        else if (any_weight > 0.0) light = any_light / any_weight;
    }
    light_write(VIEW.image_indirect, pixel, light, dither(pixel, 5));
}
