#version 460
// A draw of the classic look: one or more passes of a material (each a product of texture and colour, with an alpha
// test), the blob of a dynamic light, or fog.
// variants: MANY=-DMANY_STAGES
// variants: MAPPED=-DMANY_STAGES -DSURFACE_MAPPING
// variants: HYBRID=-DMANY_STAGES -DHYBRID
// variants: HYBRID_MAPPED=-DMANY_STAGES -DSURFACE_MAPPING -DHYBRID
// variants: COUNT=-DMANY_STAGES -DCOUNT_FRAGMENTS
// Specialization constants (`draw.glsl`) remove unused code. Without `discard` the GPU tests depth before shading.
#include "raster/draw.glsl"

layout(location = 0) in vec4 in_uv[STAGE_PAIRS]; // two stages each
layout(location = 2) in float in_clip;
layout(location = 3) in flat uvec4 in_textures; // see `Draw`; with SURFACE_MAPPING or HYBRID, the index of the draw
layout(location = 4) in vec4 in_color[STAGES];
layout(location = 8) in flat vec4 in_flat_color[STAGES];

#ifdef SURFACE_MAPPING
layout(location = 12) in vec4 in_normal; // see `draw.vert`
layout(location = 13) in vec4 in_tangent;
layout(location = 14) in vec4 in_light;
#endif

layout(location = 0) out vec4 out_color;

#ifdef COUNT_FRAGMENTS
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counter { uint fragments; };
#endif

#ifdef HYBRID
#include "raster/hybrid.glsl"
float shadow = 0.0;          // part of the light that rays found missing
vec4 reflection = vec4(0.0); // see `hybrid_reflection`
#endif

#ifdef SURFACE_MAPPING
vec2 height_shift = vec2(0.0); // of the coordinates of the texture whose normal map has heights
#endif

// The indices are dynamically uniform within a draw and need no `nonuniformEXT`.
vec4 sample_stage(uint stage) {
    if ((TEXTURES >> stage & 1) == 0) return vec4(1.0);
#if defined(SURFACE_MAPPING) || defined(HYBRID)
    uint handle = Draws(VIEW.draws).at[in_textures.x].textures[stage];
#else
    uint handle = in_textures[stage];
#endif
    vec2 uv = (stage & 1) == 0 ? in_uv[stage / 2].xy : in_uv[stage / 2].zw;
#ifdef SURFACE_MAPPING
    if ((MAPPING & MAPPING_HEIGHTS) != 0 && stage == TEXTURE_STAGE) uv += height_shift;
#endif
#ifdef HYBRID
    if ((MIRRORED >> stage & 1) != 0 && reflection.a > 0.0) {
        vec4 image = texture(sampler2D(textures[handle & 0xFFFFFF], samplers[handle >> 24]), uv);
        vec4 mean = textureLod(sampler2D(textures[handle & 0xFFFFFF], samplers[handle >> 24]), vec2(0.5), 32.0);
        return vec4(in_place_of(mean.rgb, reflection.rgb), image.a);
    }
#endif
    return texture(sampler2D(textures[handle & 0xFFFFFF], samplers[handle >> 24]), uv);
}

vec4 stage_color(uint stage) {
    uint kind = of_stage(COLOR, stage);
    return kind == COLOR_FLAT ? in_flat_color[stage] : kind == COLOR_VERTEX ? in_color[stage] : vec4(1.0);
}

vec4 stage_value(uint stage) {
    vec4 value = sample_stage(stage) * stage_color(stage);
#ifdef HYBRID
    if ((SHADOWED >> stage & 1) != 0) value.rgb *= 1.0 - shadow;
#endif
    return value;
}

bool passes_alpha_test(uint stage, vec4 color) {
    uint alpha_func = of_stage(ALPHA_FUNC, stage);
    return alpha_func == ALPHAFUNC_NONE || alpha_passes(alpha_func, color.a);
}

#ifdef MANY_STAGES
// Rounds to the 8 bits of the target image.
vec3 stored(vec3 color) { return round(color * 255.0) / 255.0; }

// Multiplies one operand of blending by its factor. Destination alpha reads as 1, as in `raster/pipelines.rs`.
vec3 weighted(vec3 side, uint factor, vec4 source, vec3 target) {
    switch (factor) {
    case BLEND_ZERO: case BLEND_ONE_MINUS_DST_ALPHA: case BLEND_SRC_ALPHA_SATURATE: return vec3(0.0);
    case BLEND_DST_COLOR: return stored(side * target);
    case BLEND_ONE_MINUS_DST_COLOR: return stored(side * (1.0 - target));
    case BLEND_SRC_ALPHA: return stored(side * source.a);
    case BLEND_ONE_MINUS_SRC_ALPHA: return stored(side * (1.0 - source.a));
    case BLEND_SRC_COLOR: return stored(side * source.rgb);
    case BLEND_ONE_MINUS_SRC_COLOR: return stored(side * (1.0 - source.rgb));
    default: return side;
    }
}

// Blends a pass over the result of the previous passes, rounded to multiples of 1/255 as software drivers do, OpenGL's
// included; GPUs blend with a finer source and sum.
vec4 blend(vec4 before, vec4 pass, uint stage) {
    vec4 source = clamp(pass, 0.0, 1.0);
    source = vec4(stored(source.rgb), round(source.a * 255.0) / 255.0);
    vec3 target = stored(clamp(before.rgb, 0.0, 1.0));
    return vec4(weighted(source.rgb, of_stage(BLEND_SOURCE, stage), source, target)
        + weighted(target, of_stage(BLEND_TARGET, stage), source, target), 1.0);
}

// Combines a stage with the result of the previous stages.
vec4 onto(vec4 before, uint stage) {
    uint combine = of_stage(COMBINE, stage);
    if (combine == COMBINE_NONE) return before;
    vec4 color = stage_value(stage);
    // a fragment that fails the alpha test keeps the previous result
    if (combine == COMBINE_BLEND) return passes_alpha_test(stage, color) ? blend(before, color, stage) : before;
    if (combine == COMBINE_MODULATE) color *= before;
    if (combine == COMBINE_ADD) color = vec4(before.rgb + color.rgb, before.a * color.a);
    if (!passes_alpha_test(stage, color)) discard;
    return color;
}
#endif

#ifdef SURFACE_MAPPING
#include "raster/surface_mapping.glsl"
#else
vec4 mapped_after(uint stage, vec4 color) { return color; }
#endif

#ifdef MANY_STAGES
// Light that the first stage's texture reflects: diffuse with a linear falloff of d^2/r^2, and a Blinn-Phong highlight
// (Quake3e's `ARB_BuildDlightFP`). The vectors are not normalized, the normal neither: as there.
vec3 pixel_light() {
    vec3 to_light = in_color[0].xyz;
    float falloff = 1.0 - dot(to_light, to_light) * in_flat_color[0].w;
    if (falloff < 0.0) discard;
    vec3 light = normalize(to_light);
    vec3 view = normalize(in_color[1].xyz);
    vec3 normal = in_color[2].xyz;
    float diffuse = dot(normal, light);
    float specular = dot(normal, normalize(light + view));
    if (in_flat_color[1].w != 0.0) {
        if (dot(normal, view) * diffuse < 0.0) discard; // light and camera on different sides
        diffuse = abs(diffuse);
        specular = abs(specular);
    }
    vec3 base = sample_stage(0).rgb;
    float reflectance = in_flat_color[1].y;
    vec3 highlight = reflectance > 0.0 ? vec3(reflectance) : base * -reflectance;
    vec3 reflected = base * clamp(diffuse, 0.0, 1.0) + highlight * pow(clamp(specular, 0.0, 1.0), in_flat_color[1].z);
    float in_fog = fog_factor(vec2(in_color[0].w, in_color[1].w)); // 0 without fog
    return clamp(reflected * (1.0 - in_fog) * in_flat_color[0].rgb * falloff, 0.0, 1.0);
}
#endif

void main() {
#ifdef HYBRID
    HybridPlaces places = hybrid_places();
    bool dynamic = (SHADOWED & 16u) != 0;
    if (SHADOWED != 0) shadow = hybrid_shadow(places, dynamic, dynamic ? Draws(VIEW.draws).at[in_textures.x].light : 0);
    if (MIRRORED != 0) reflection = hybrid_reflection(places);
#endif
    if (CLIP != 0 && in_clip < 0.0) discard;
    if (MODE == DRAW_LIGHT) {
        out_color = vec4(in_color[0].rgb * sample_stage(0).rgb, 1.0);
#ifdef MANY_STAGES
    } else if (MODE == DRAW_PIXEL_LIGHT) {
        out_color = vec4(pixel_light(), 1.0);
#endif
    } else if (MODE == DRAW_FOG) {
        out_color = vec4(in_flat_color[0].rgb, sample_stage(0).a);
    } else {
#ifdef SURFACE_MAPPING
        if ((MAPPING & MAPPING_HEIGHTS) != 0) height_shift = shift_by_heights();
#endif
        out_color = stage_value(0);
        if (!passes_alpha_test(0, out_color)) discard;
#ifdef MANY_STAGES
        // unrolled by hand, so that arguments are constant for every compiler
        out_color = mapped_after(0, out_color);
        out_color = mapped_after(1, onto(out_color, 1));
        out_color = mapped_after(2, onto(out_color, 2));
        out_color = mapped_after(3, onto(out_color, 3));
#endif
    }
#ifdef HYBRID
    if (dynamic) out_color.rgb *= 1.0 - shadow;
#endif
#ifdef COUNT_FRAGMENTS
    // no early depth test is declared, so that hidden fragments count too
    atomicAdd(Counter(push.overdraw).fragments, 1);
#endif
}
