#version 460
// One draw of the classic look: texture times colour, one or two textures, alpha test, a light's blob, or fog.
// The constants of draw.glsl leave only what the draw needs; without `discard`, depth is tested first.
#include "raster/draw.glsl"

layout(location = 0) in vec4 in_color;
layout(location = 1) in vec4 in_uv;
layout(location = 2) in float in_clip;
layout(location = 3) in flat vec4 in_flat_color;
layout(location = 4) in flat uvec2 in_textures; // see `Draw`

layout(location = 0) out vec4 out_color;

// The indices are the same for the whole draw, so they need no nonuniformEXT.
vec4 sample_stage(uint stage, uint handle, vec2 uv) {
    if ((TEXTURES >> stage & 1) == 0) return vec4(1.0);
    return texture(sampler2D(textures[handle & 0xFFFFFF], samplers[handle >> 24]), uv);
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
    if (CLIP != 0 && in_clip < 0.0) discard;
    if (MODE == DRAW_LIGHT) {
        out_color = vec4(in_color.rgb * blob(in_uv.xy), 1.0);
    } else if (MODE == DRAW_FOG) {
        out_color = vec4(in_flat_color.rgb, sample_stage(0, in_textures.x, in_uv.xy).a);
    } else {
        vec4 color = sample_stage(0, in_textures.x, in_uv.xy);
        if (COLOR == COLOR_FLAT) color *= in_flat_color;
        if (COLOR == COLOR_VERTEX) color *= in_color;
        if (COMBINE != COMBINE_NONE) {
            vec4 second = sample_stage(1, in_textures.y, in_uv.zw);
            if (COMBINE == COMBINE_REPLACE) color = second;
            else color = COMBINE == COMBINE_ADD ? vec4(color.rgb + second.rgb, color.a * second.a) : color * second;
        }
        if (ALPHA_FUNC != ALPHAFUNC_NONE && !alpha_passes(ALPHA_FUNC, color.a)) discard;
        out_color = color;
    }
}
