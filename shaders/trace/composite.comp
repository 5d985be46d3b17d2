#version 460
// Puts light and surface together: what is in front + albedo * light. In reference mode it joins the running mean of the
// frames since anything changed.
#include "trace/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= int(VIEW.width) || pixel.y >= int(VIEW.height)) return;
    // what glows by itself, sky and fog show as the engine shows them when the map is exposed to look as bright as there
    vec3 radiance = imageLoad(images_rgba16f[VIEW.image_front], pixel).rgb * exp2(-VIEW.exposure_base);
    GBufferPixel g = gbuffer_read(pixel);
    if (g.path >= 0.0) {
        vec3 light;
        if ((VIEW.flags & VIEW_DENOISE) != 0) light = imageLoad(images_rgba16f[VIEW.image_lit], pixel).rgb;
        else light = imageLoad(images_rgba16f[VIEW.image_direct], pixel).rgb + imageLoad(images_rgba16f[VIEW.image_indirect], pixel).rgb;
        radiance += g.albedo * light;
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
