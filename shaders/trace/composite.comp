#version 460
// Puts light and surface together: what is in front + albedo * light. In reference mode it joins the running mean of the
// frames since anything changed. Where a reflection and what lies behind it are seen in one place, pixels show either in
// turns, like the fields of a chessboard: there a pixel is the mean of what it shows and what its neighbours of the
// other field show.
#include "trace/denoise.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// What a pixel shows by itself. `front`: what the primary rays have composed there.
vec3 shown(ivec2 pixel, vec3 front) {
    // what glows by itself, sky and fog show as the engine shows them when the map is exposed to look as bright as there
    vec3 radiance = front * exp2(-VIEW.exposure_base);
    GBufferPixel g = gbuffer_read(pixel);
    if (g.path >= 0.0) {
        vec3 light;
        if ((VIEW.flags & VIEW_DENOISE) != 0) {
            light = filtered_light(pixel);
        } else {
            light = light_read(VIEW.image_direct, pixel) + light_read(VIEW.image_indirect, pixel);
        }
        radiance += g.albedo * light;
    }
    return radiance;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(VIEW.width, VIEW.height);
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    vec4 front = imageLoad(images_rgba16f[VIEW.image_front], pixel);
    vec3 radiance = shown(pixel, front.rgb);
    // its alpha is the field: 0 none, 1 or 2
    if (front.a > 0.0) {
        const ivec2 beside[4] = ivec2[](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
        vec3 others = vec3(0.0);
        float count = 0.0;
        for (int i = 0; i < 4; i++) {
            ivec2 at = pixel + beside[i];
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
            vec4 other = imageLoad(images_rgba16f[VIEW.image_front], at);
            if (other.a != 3.0 - front.a) continue;
            others += shown(at, other.rgb);
            count += 1.0;
        }
        if (count > 0.0) radiance = 0.5 * (radiance + others / count);
    }
    // one broken number must not spread through exposure and accumulation
    if (any(isnan(radiance)) || any(isinf(radiance))) radiance = vec3(0.0);
    if ((VIEW.flags & VIEW_ACCUMULATE) == 0) {
        imageStore(images_rgba16f[VIEW.image_composite], pixel, vec4(min(radiance, vec3(60000.0)), 1.0));
        return;
    }
    if (VIEW.accumulated > 0) {
        vec3 mean = imageLoad(images_rgba32f[VIEW.image_accumulation], pixel).rgb;
        radiance = mean + (radiance - mean) / float(VIEW.accumulated + 1);
    }
    imageStore(images_rgba32f[VIEW.image_accumulation], pixel, vec4(radiance, 1.0));
}
