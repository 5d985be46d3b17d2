#version 460
// The temporal gradient of each stratum's own sample: the difference between its light and the light of the same sample
// in the last frame (Schied et al. 2018, section 4.2). Writes the input of `gradient.comp`, one texel: change and size
// of direct light, of indirect light, and the logarithms of the last frame's filtered luminance, as 16-bit floats; the
// guide.
#include "trace/subsample.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uint level_of(GradientPixel c) {
    return packHalf2x16(log2(unpackHalf2x16(LightTexels(DENOISE.history).at[place_of(c.last)].x) + 1.0e-5));
}

uvec2 gradient_at(ivec2 stratum, GradientPixel c) {
    ivec2 pixel = pixel_of(stratum, c.index);
    vec2 now = vec2(luminance(light_read(VIEW.images.direct, pixel)), 0.0);
    if (VIEW.transport.bounces != 0) now.y = luminance(light_read(VIEW.images.indirect, pixel));
    // rounded like the stored sample
    now = unpackHalf2x16(packHalf2x16(now));
    vec2 then = unpackHalf2x16(imageLoad(uimages_rgba32ui[DENOISE.sample_surfaces], c.last / STRATUM).z);
    vec2 change = now - then, size = max(now, then);
    if (then.y < 0.0 || !is_gathered(pixel)) change.y = size.y = 0.0;
    return uvec2(packHalf2x16(vec2(change.x, size.x)), packHalf2x16(vec2(change.y, size.y)));
}

void main() {
    ivec2 stratum = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(stratum * STRATUM)) return;
    uvec4 texel = uvec4(0, 0, 0, imageLoad(uimages_r32ui[DENOISE.stratum_guide], stratum).x);
    if (texel.w != 0) {
        GradientPixel c = gradient_pixel_at(stratum);
        if (c.valid) texel.xyz = uvec3(gradient_at(stratum, c), level_of(c));
    }
    LightTexels(DENOISE.gradient_samples).at[stratum_place(stratum)] = texel;
}
