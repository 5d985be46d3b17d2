#version 460
// One draw of the classic look: texture times colour, one or two textures, alpha test, a light's blob, or fog.
#include "raster/draw.glsl"

layout(location = 0) in vec4 in_color;
layout(location = 1) in vec4 in_uv;
layout(location = 2) in float in_clip;
layout(location = 3) in flat uint in_draw;

layout(location = 0) out vec4 out_color;

vec4 sample_stage(RasterView view, Draw draw, Stage stage, float time, vec2 uv) {
    uint image = stage_image(view.materials, stage, draw.lightmap, time);
    if (image == NO_TEXTURE || (stage.flags & STAGE_WHITE) != 0) return vec4(1.0);
    return texture(sampler2D(textures[nonuniformEXT(image)], samplers[nonuniformEXT(stage.sampler_index)]), uv);
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
    RasterView view = Views(push.view).view;
    Draw draw = Draws(view.draws).at[in_draw];
    switch (draw.mode) {
    case DRAW_STAGE: {
        Stages stages = Stages(view.materials.stages);
        Stage first = stages.at[draw.stages[0]];
        Material material = Materials(view.materials.materials).at[draw.material];
        float time = shader_time(material, Instances(view.instances).at[draw.instance]);
        vec4 color = sample_stage(view, draw, first, time, in_uv.xy) * in_color;
        if (draw.stage_count > 1) {
            vec4 second = sample_stage(view, draw, stages.at[draw.stages[1]], time, in_uv.zw);
            color = draw.combine == COMBINE_ADD ? vec4(color.rgb + second.rgb, color.a * second.a) : color * second;
        }
        if (!alpha_passes(first.alpha_func, color.a)) discard;
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
        // sampler 3: clamped, without mip levels
        out_color = texture(sampler2D(textures[nonuniformEXT(draw.argument)], samplers[3]), in_uv.xy) * in_color;
        break;
    default:
        out_color = in_color;
    }
}
