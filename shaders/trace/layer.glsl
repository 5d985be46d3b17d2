// A stack of stages as light sees it: what reaches the eye is lit * L + emission + through * background + reflected * R,
// where L is the light that a white diffuse surface would show here, and R what the mirrored ray sees.
// shaderscript::light has the same algebra (without reflections) on the CPU and its tests.
#ifndef RELIGHT_TRACE_LAYER_GLSL
#define RELIGHT_TRACE_LAYER_GLSL

#include "trace/color.glsl"
#include "trace/geometry.glsl"

struct Layer {
    vec3 lit;
    vec3 emission;
    vec3 through;
    vec3 reflected;
};

Layer layer_nothing() { return Layer(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)); }

// Level of detail for a texture whose coordinates change by `scale` per unit where the ray's cone is `width` wide.
float texture_lod(uint image, float scale, float width) {
    vec2 size = vec2(textureSize(textures[nonuniformEXT(image)], 0));
    float texels = width * scale * sqrt(size.x * size.y);
    return max(log2(max(texels, 1.0e-6)), 0.0);
}

// The stage's image at the point; white where there is none. `width`: of the ray's cone at the hit, units.
vec4 stage_texel(Stage stage, SurfacePoint p, Instance instance, float width) {
    uint image = stage_image(VIEW.materials, stage, p.triangle.lightmap, p.stage.time);
    if ((stage.flags & STAGE_WHITE) != 0 || image == NO_TEXTURE) return vec4(1.0);
    vec2 uv = stage_texcoord(VIEW.materials, stage, instance, p.stage);
    float scale = p.texel_scale;
    if (stage.tc_gen == TCGEN_ENVIRONMENT) {
        scale = 0.0;
    } else if (stage.tc_gen == TCGEN_VECTOR) {
        scale = sqrt(length(stage.vector_s) * length(stage.vector_t));
    } else if (stage.tc_mod_count > 0) {
        // how much the modifiers stretch the image: the Jacobian by differences
        const float step_st = 1.0 / 64.0;
        SurfacePoint q = p;
        q.stage.st = p.stage.st + vec2(step_st, 0.0);
        vec2 ds = stage_texcoord(VIEW.materials, stage, instance, q.stage) - uv;
        q.stage.st = p.stage.st + vec2(0.0, step_st);
        vec2 dt = stage_texcoord(VIEW.materials, stage, instance, q.stage) - uv;
        scale *= sqrt(abs(ds.x * dt.y - ds.y * dt.x)) / step_st;
    }
    float lod = texture_lod(image, scale, width);
    return textureLod(sampler2D(textures[nonuniformEXT(image)], samplers[nonuniformEXT(stage.sampler_index)]), uv, lod);
}

// Whether the surface is there at all: where a stage that writes depth passes its alpha test.
bool is_solid_at(SurfacePoint p, float width) {
    Material material = material_of(p.triangle.material);
    Instance instance = instance_of(p.instance);
    Stages stages = Stages(VIEW.materials.stages);
    bool tested = false;
    for (uint i = 0; i < material.stage_count; i++) {
        Stage stage = stages.at[material.stage_first + i];
        if (stage.alpha_func == ALPHAFUNC_NONE || (stage.flags & STAGE_DEPTH_WRITE) == 0) continue;
        tested = true;
        float alpha = stage_texel(stage, p, instance, width).a * stage_color(VIEW.materials, stage, instance, p.stage).a;
        if (alpha_passes(stage.alpha_func, alpha)) return true;
    }
    return !tested;
}

// a * b for polynomials in L and the background. Light seen twice counts once: L * L becomes L. What the background
// is multiplied by, light included, scales it.
Layer layer_product(Layer a, Layer b) {
    Layer r;
    r.lit = a.lit * b.lit + a.lit * b.emission + a.emission * b.lit;
    r.emission = a.emission * b.emission;
    r.through = a.through * (b.lit + b.emission) + b.through * (a.lit + a.emission);
    // so does it scale what is reflected, which brings its own light, too
    r.reflected = a.reflected * (b.lit + b.emission) + b.reflected * (a.lit + a.emission);
    return r;
}

Layer layer_scale(Layer a, float s) { return Layer(a.lit * s, a.emission * s, a.through * s, a.reflected * s); }
Layer layer_add(Layer a, Layer b) {
    return Layer(a.lit + b.lit, a.emission + b.emission, a.through + b.through, a.reflected + b.reflected);
}
Layer layer_subtract(Layer a, Layer b) {
    return Layer(a.lit - b.lit, a.emission - b.emission, a.through - b.through, a.reflected - b.reflected);
}

// `value` times a blend factor. The frame buffer has no alpha of its own: destination alpha reads as one.
Layer layer_blend(uint factor, Layer value, Layer source, Layer destination, float source_alpha) {
    switch (factor) {
    case BLEND_ONE: return value;
    case BLEND_DST_COLOR: return layer_product(value, destination);
    case BLEND_ONE_MINUS_DST_COLOR: return layer_subtract(value, layer_product(value, destination));
    case BLEND_SRC_COLOR: return layer_product(value, source);
    case BLEND_ONE_MINUS_SRC_COLOR: return layer_subtract(value, layer_product(value, source));
    case BLEND_SRC_ALPHA: return layer_scale(value, source_alpha);
    case BLEND_ONE_MINUS_SRC_ALPHA: return layer_scale(value, 1.0 - source_alpha);
    case BLEND_DST_ALPHA: return value;
    default: return layer_nothing(); // ZERO, ONE_MINUS_DST_ALPHA, SRC_ALPHA_SATURATE
    }
}

// One over the linear value of half the display's range.
const float DOUBLE_PRODUCT = 1.0 / 0.21404114;

// Runs the stages of the point's material over the background.
Layer evaluate_stages(SurfacePoint p, float width) {
    Material material = material_of(p.triangle.material);
    bool world = (p.triangle.flags & TRIANGLE_WORLD) != 0;
    if (material.plain_image != NO_TEXTURE && (world || (material.flags & MATERIAL_VERTEX_LIGHT) == 0)) {
        // what the stages below come to, for the many materials that are an image under light
        float lod = texture_lod(material.plain_image, p.texel_scale, width);
        vec3 texel = textureLod(sampler2D(textures[nonuniformEXT(material.plain_image)],
            samplers[nonuniformEXT(material.plain_sampler)]), p.stage.st, lod).rgb;
        return Layer(decode_display(texel), vec3(0.0), vec3(0.0), vec3(0.0));
    }
    Instance instance = instance_of(p.instance);
    Stages stages = Stages(VIEW.materials.stages);
    Layer layer = Layer(vec3(0.0), vec3(0.0), vec3(1.0), vec3(0.0));
    for (uint i = 0; i < material.stage_count; i++) {
        Stage stage = stages.at[material.stage_first + i];
        vec4 color = stage_color(VIEW.materials, stage, instance, p.stage);
        Layer source = layer_nothing();
        float alpha;
        if (stage.image_count == 0 && (stage.flags & STAGE_WHITE) == 0) {
            // the lightmap: the light itself, as bright as the stage lets it through
            source.lit = decode_display(color.rgb);
            alpha = color.a;
        } else if ((stage.flags & STAGE_REFLECTION) != 0) {
            // the picture of an environment in the mean: its smallest level. What it shows, the mirrored ray finds
            uint image = stage_image(VIEW.materials, stage, NO_TEXTURE, p.stage.time);
            vec4 mean = textureLod(sampler2D(textures[nonuniformEXT(image)], samplers[nonuniformEXT(stage.sampler_index)]), vec2(0.5), 32.0);
            source.reflected = decode_display(mean.rgb) * decode_display(color.rgb);
            alpha = mean.a * color.a;
        } else {
            vec4 texel = stage_texel(stage, p, instance, width);
            vec3 image = decode_display(texel.rgb);
            bool baked = world && (material.flags & MATERIAL_VERTEX_LIGHT) != 0
                && (stage.rgb_gen == RGBGEN_VERTEX || stage.rgb_gen == RGBGEN_EXACT_VERTEX);
            if (stage.rgb_gen == RGBGEN_LIGHTING_DIFFUSE || baked) {
                source.lit = image;
                alpha = texel.a * (stage.rgb_gen == RGBGEN_LIGHTING_DIFFUSE && stage.alpha_gen == ALPHAGEN_IDENTITY ? 1.0 : color.a);
            } else {
                vec3 shown = image * decode_display(color.rgb);
                bool matter = !world && (stage.flags & STAGE_MATTER) != 0;
                if (matter && (material.flags & MATERIAL_POLYGON_OFFSET) != 0) {
                    source.lit = shown; // a mark on a surface is lit with it
                } else {
                    // what hangs in the air shows the light around it: as layers it can only glow
                    if (matter && (instance.flags & INSTANCE_SUSPENDED) != 0) shown *= decode_display(instance.ambient);
                    source.emission = shown;
                }
                alpha = texel.a * color.a;
            }
        }
        if (stage.alpha_func != ALPHAFUNC_NONE && !alpha_passes(stage.alpha_func, alpha)) continue;
        if (stage.blend_src == BLEND_DST_COLOR && stage.blend_dst == BLEND_SRC_COLOR) {
            // twice the product, as displayed: half grey leaves what is below as it is, so it has to here too
            layer = layer_scale(layer_product(layer, source), DOUBLE_PRODUCT);
            continue;
        }
        layer = layer_add(layer_blend(stage.blend_src, source, source, layer, alpha),
            layer_blend(stage.blend_dst, layer, source, layer, alpha));
    }
    return layer;
}

// What a lamp shows of the light that it gives: its texture at up to full brightness.
vec3 shown_glow(Material material) {
    vec3 radiance = material.light_radiance;
    return radiance / (1.0 + max_component(radiance));
}

// The layer as an eye sees it: an emitter's surface glows with its own texture.
Layer evaluate_layer(SurfacePoint p, float width) {
    Layer layer = evaluate_stages(p, width);
    Material material = material_of(p.triangle.material);
    layer.emission += layer.lit * shown_glow(material);
    layer.lit = max(layer.lit, 0.0);
    layer.emission = max(layer.emission, 0.0);
    layer.through = max(layer.through, 0.0);
    layer.reflected = max(layer.reflected, 0.0);
    return layer;
}

#endif
