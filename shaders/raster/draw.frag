#version 460
// One draw of the classic look: texture times colour, one or two textures, alpha test, a light's blob, or fog.
#include "raster/draw.glsl"

layout(location = 0) in vec4 in_color;
layout(location = 1) in vec4 in_uv;
layout(location = 2) in float in_clip;
layout(location = 3) in flat uvec4 in_draw; // see draw.glsl

layout(location = 0) out vec4 out_color;

// The indices are the same for the whole draw, so they need no nonuniformEXT.
vec4 sample_stage(uint image, uint sampler_index, vec2 uv) {
    if (image == NO_TEXTURE) return vec4(1.0);
    return texture(sampler2D(textures[image], samplers[sampler_index]), uv);
}

// The engine's 16x16 blob: brightness 4000 / d^2 in texels from the middle, nothing below 75 of 255, at most 255.
float blob_texel(vec2 texel) {
    vec2 d = texel - 7.5;
    float b = floor(4000.0 / dot(d, d));
    return b < 75.0 ? 0.0 : min(b, 255.0) / 255.0;
}

float blob(vec2 uv) {
    vec2 p = clamp(uv, 0.0, 1.0) * 16.0 - 0.5;
    vec2 low = floor(p), f = p - low;
    vec2 a = clamp(low, 0.0, 15.0), b = clamp(low + 1.0, 0.0, 15.0);
    return mix(mix(blob_texel(a), blob_texel(vec2(b.x, a.y)), f.x), mix(blob_texel(vec2(a.x, b.y)), blob_texel(b), f.x), f.y);
}

void main() {
    if (in_clip < 0.0) discard;
    switch (in_draw.w) {
    case DRAW_STAGE: {
        vec4 color = sample_stage(in_draw.x, in_draw.z & 0xFF, in_uv.xy) * in_color;
        if (in_draw.y != NO_TEXTURE) {
            vec4 second = sample_stage(in_draw.y, in_draw.z >> 8 & 0xFF, in_uv.zw);
            color = (in_draw.z >> 20 & 1) == COMBINE_ADD ? vec4(color.rgb + second.rgb, color.a * second.a) : color * second;
        }
        if (!alpha_passes(in_draw.z >> 16 & 0xF, color.a)) discard;
        out_color = color;
        break;
    }
    case DRAW_LIGHT:
        out_color = vec4(in_color.rgb * blob(in_uv.xy), 1.0);
        break;
    case DRAW_FOG:
        out_color = vec4(in_color.rgb, fog_factor(in_uv.xy));
        break;
    case DRAW_IMAGE:
    case DRAW_LIGHTMAP:
        // sampler 3: clamped, without mip levels
        out_color = sample_stage(in_draw.x, 3, in_uv.xy) * in_color;
        break;
    default:
        out_color = in_color;
    }
}
