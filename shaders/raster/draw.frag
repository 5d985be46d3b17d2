#version 460
// One draw of the classic look: texture times colour, one or two textures, alpha test, a light's blob, or fog.
// variants: COUNT=-DCOUNT_FRAGMENTS
// The constants of draw.glsl leave only what the draw needs; without `discard`, depth is tested first.
#include "raster/draw.glsl"

layout(location = 0) in vec4 in_color;
layout(location = 1) in vec4 in_uv;
layout(location = 2) in float in_clip;
layout(location = 3) in flat vec4 in_flat_color;
layout(location = 4) in flat uvec2 in_textures; // see `Draw`

layout(location = 0) out vec4 out_color;

#ifdef COUNT_FRAGMENTS
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counter { uint fragments; };
#endif

// The indices are the same for the whole draw, so they need no nonuniformEXT.
vec4 sample_stage(uint stage, uint handle, vec2 uv) {
    if ((TEXTURES >> stage & 1) == 0) return vec4(1.0);
    return texture(sampler2D(textures[handle & 0xFFFFFF], samplers[handle >> 24]), uv);
}

void main() {
    if (CLIP != 0 && in_clip < 0.0) discard;
    if (MODE == DRAW_LIGHT) {
        out_color = vec4(in_color.rgb * sample_stage(0, in_textures.x, in_uv.xy).rgb, 1.0);
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
#ifdef COUNT_FRAGMENTS
    // nothing asks for early tests, so that what is hidden is counted, too
    atomicAdd(Counter(push.overdraw).fragments, 1);
#endif
}
