// Stages of a material as a linear function of light: outgoing radiance = lit * L + emission + through * background +
// reflected * R. L: radiance of a white diffuse surface at this point; R: radiance along the mirrored ray.
//
// Stages are combined in displayed (encoded) values, because their authors chose sums and mixtures by what the display
// shows. Products are nearly the same in linear light, but the sum of two linear values displays darker than the sum of
// the two displayed values. `evaluate_stages` converts each part by itself to linear light; `primary.rgen` weights the
// parts of a pixel by their shares of the displayed value. `shaderscript::light` has the same algebra (without
// reflections) on the CPU, with tests, in linear light except for mixtures on an opaque body.
#ifndef RELIGHT_TRACE_LAYER_GLSL
#define RELIGHT_TRACE_LAYER_GLSL

#include "trace/color.glsl"
#include "trace/geometry.glsl"

struct Layer {
    vec3 lit;
    vec3 emission;
    vec3 through;
    vec3 reflected;
    vec3 haze; // part of the emission that uses the light shown by the engine at this point
};

Layer layer_nothing() { return Layer(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)); }

// The area of a texture that a ray covers.
struct Footprint {
    float width; // of the ray's cone at the hit, units; on slanted surfaces the geometric mean of the ellipse's axes
    // Axes of the ellipse in which the cone meets the surface, texture coordinates; 0: unknown.
    vec2 along;
    vec2 across;
};

Footprint round_footprint(float width) { return Footprint(width, vec2(0.0), vec2(0.0)); }

// Level of detail of a texture whose coordinates change by `scale` per unit, for a cone of `width` units.
float texture_lod(uint image, float scale, float width) {
    vec2 size = vec2(textureSize(textures[nonuniformEXT(image)], 0));
    float texels = width * scale * sqrt(size.x * size.y);
    return max(log2(max(texels, 1.0e-6)), 0.0);
}

// Ellipse, in texture coordinates, of a cone that is `width` units wide at the surface: the cone's section with the
// plane (Akenine-Möller et al., Improved Shader and Texture Level of Detail Using Ray Cones, JCGT 2021, section 5), by
// the triangle's gradients.
Footprint ellipse_footprint(SurfacePoint p, vec3 direction, float cosine, float width) {
    Footprint f = round_footprint(width * inversesqrt(cosine));
    TraceVertices vertices = TraceVertices(p.vertices);
    Vertex a = vertices.at[p.triangle.indices[0]], b = vertices.at[p.triangle.indices[1]], c = vertices.at[p.triangle.indices[2]];
    Instance instance = instance_of(p.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
    vec3 ab = axis * (b.position - a.position), ac = axis * (c.position - a.position);
    vec3 n = cross(ab, ac);
    float area_squared = dot(n, n);
    vec3 depth_gradient = direction - p.face_normal * dot(p.face_normal, direction);
    float slant = length(depth_gradient);
    if (!(area_squared > 0.0) || slant < 0.1) return f; // nearly perpendicular: a circle
    vec3 along = depth_gradient * (width / (cosine * slant));
    vec3 across = cross(p.face_normal, depth_gradient) * (width / slant);
    vec2 sb = b.st - a.st, sc = c.st - a.st;
    f.along = (dot(cross(along, ac), n) * sb + dot(cross(ab, along), n) * sc) / area_squared;
    f.across = (dot(cross(across, ac), n) * sb + dot(cross(ab, across), n) * sc) / area_squared;
    return f;
}

// The part of an image that is averaged: `count` lookups at `lod`, side by side along `axis`.
struct Lookups {
    vec2 axis;
    float count;
    float lod;
};

// Lookups that cover an ellipse: of the shorter axis's width, side by side along the longer axis, as anisotropic
// samplers do, but equal with every driver. If the allowed number does not cover the ellipse, they cover a part of it,
// so that the result is never less sharp than the round footprint.
Lookups ellipse_lookups(uint image, vec2 along, vec2 across) {
    vec2 size = vec2(textureSize(textures[nonuniformEXT(image)], 0));
    float longer = length(along * size), shorter = length(across * size);
    vec2 axis = along;
    if (longer < shorter) {
        axis = across;
        float other = longer;
        longer = shorter;
        shorter = other;
    }
    float most = min(VIEW.antialias.anisotropy, 16.0);
    float covered = min(longer, most * sqrt(longer * shorter));
    axis *= covered / max(longer, 1.0e-12);
    // a magnified image needs one lookup
    float count = clamp(ceil(covered / max(shorter, 1.0)), 1.0, floor(most));
    return Lookups(axis, count, max(log2(max(covered / count, 1.0e-6)), 0.0));
}

// Mean of the image over the lookups.
vec4 texel_mean(uint image, uint sampler_index, vec2 uv, Lookups lookups) {
    vec4 sum = vec4(0.0);
    for (float i = 0.5; i < lookups.count; i += 1.0)
        sum += textureLod(sampler2D(textures[nonuniformEXT(image)], samplers[nonuniformEXT(sampler_index)]),
            uv + lookups.axis * (i / lookups.count - 0.5), lookups.lod);
    return sum / lookups.count;
}

bool has_ellipse(Footprint f) { return VIEW.antialias.anisotropy > 1.0 && f.along != vec2(0.0); }

// The image of a material that is one image under light, at the point.
vec4 plain_texel(Material material, SurfacePoint p, Footprint footprint) {
    Lookups lookups;
    if (has_ellipse(footprint)) lookups = ellipse_lookups(material.plain_image, footprint.along, footprint.across);
    else lookups = Lookups(vec2(0.0), 1.0, texture_lod(material.plain_image, p.texel_scale, footprint.width));
    return texel_mean(material.plain_image, material.plain_sampler, p.stage.st, lookups);
}

// The stage's image at the point; white for a stage without an image.
vec4 stage_texel(Stage stage, SurfacePoint p, Instance instance, Footprint footprint) {
    uint image = stage_image(VIEW.materials, stage, p.triangle.lightmap, p.stage.time);
    if ((stage.flags & STAGE_WHITE) != 0 || image == NO_TEXTURE) return vec4(1.0);
    mat2 jacobian;
    vec2 uv = stage_texcoord(VIEW.materials, stage, instance, p.stage, jacobian);
    Lookups lookups;
    if (stage.tc_gen == TCGEN_BASE && has_ellipse(footprint)) {
        lookups = ellipse_lookups(image, jacobian * footprint.along, jacobian * footprint.across);
    } else {
        float scale = p.texel_scale;
        if (stage.tc_gen == TCGEN_ENVIRONMENT) scale = 0.0;
        if (stage.tc_gen == TCGEN_VECTOR) scale = sqrt(length(stage.vector_s) * length(stage.vector_t));
        scale *= sqrt(abs(determinant(jacobian)));
        lookups = Lookups(vec2(0.0), 1.0, texture_lod(image, scale, footprint.width));
    }
    return texel_mean(image, stage.sampler_index, uv, lookups);
}

// Texture coordinates of a material's maps: those of its texture.
vec2 map_texcoord(Specular specular, SurfacePoint p, out mat2 jacobian) {
    jacobian = mat2(1.0);
    if (specular.stage == NO_STAGE) return p.stage.st;
    return stage_texcoord(VIEW.materials, Stages(VIEW.materials.stages).at[specular.stage], instance_of(p.instance), p.stage, jacobian);
}

// A map of a material at the point, where the material's texture is.
vec4 map_texel(Specular specular, uint map, SurfacePoint p, Footprint footprint) {
    mat2 jacobian;
    vec2 uv = map_texcoord(specular, p, jacobian);
    float scale = p.texel_scale * sqrt(abs(determinant(jacobian)));
    return texel_mean(map, specular.sampler_index, uv, Lookups(vec2(0.0), 1.0, texture_lod(map, scale, footprint.width)));
}

// Whether the point is solid: whether a stage that writes depth passes its alpha test.
bool is_solid_at(SurfacePoint p, float width) {
    Material material = material_of(p.triangle.material);
    Instance instance = instance_of(p.instance);
    Stages stages = Stages(VIEW.materials.stages);
    bool tested = false;
    for (uint i = 0; i < material.stage_count; i++) {
        Stage stage = stages.at[material.stage_first + i];
        if (stage.alpha_func == ALPHAFUNC_NONE || (stage.flags & STAGE_DEPTH_WRITE) == 0) continue;
        tested = true;
        float alpha = stage_texel(stage, p, instance, round_footprint(width)).a * stage_color(VIEW.materials, stage, instance, p.stage).a;
        if (alpha_passes(stage.alpha_func, alpha)) return true;
    }
    return !tested;
}

// Light of a model from the light grid, as displayed.
vec3 grid_light(SurfacePoint p, Instance instance) {
    float incoming = max(dot(p.stage.normal, instance.light_direction), 0.0);
    return min(instance.ambient - instance.added + incoming * instance.directed, vec3(1.0));
}

// The light that the engine shows at a surface, as displayed: lightmap, vertex colours, or light grid for models. It
// lights nothing; it gives the shares of layers in a displayed sum.
vec3 displayed_light(SurfacePoint p) {
    if ((p.triangle.flags & TRIANGLE_WORLD) != 0) {
        uint page = p.triangle.lightmap;
        if (page == NO_TEXTURE) return p.stage.color.rgb;
        return textureLod(sampler2D(textures[nonuniformEXT(page)], samplers[VIEW.scene.sky_sampler]), p.stage.lightmap, 0.0).rgb;
    }
    Instance instance = instance_of(p.instance);
    if ((instance.flags & INSTANCE_UNLIT) != 0) return vec3(1.0);
    return grid_light(p, instance);
}

// a * b for polynomials in L and the background. Light counts once: L * L becomes L. The background brings its own
// light; its factors, including the light that the engine shows here (`light`), scale it.
Layer layer_product(Layer a, Layer b, vec3 light) {
    Layer r;
    r.lit = a.lit * b.lit + a.lit * b.emission + a.emission * b.lit;
    r.emission = a.emission * b.emission;
    r.through = a.through * (b.lit * light + b.emission) + b.through * (a.lit * light + a.emission);
    // the reflected part brings its own light too, and is scaled likewise
    r.reflected = a.reflected * (b.lit + b.emission) + b.reflected * (a.lit + a.emission);
    r.haze = a.haze * (b.lit * light + b.emission) + b.haze * (a.lit * light + a.emission);
    return r;
}

Layer layer_scale(Layer a, float s) { return Layer(a.lit * s, a.emission * s, a.through * s, a.reflected * s, a.haze * s); }
Layer layer_add(Layer a, Layer b) {
    return Layer(a.lit + b.lit, a.emission + b.emission, a.through + b.through, a.reflected + b.reflected, a.haze + b.haze);
}

// `value` times a blend factor. The frame buffer has no alpha: destination alpha reads as one.
Layer layer_blend(uint factor, Layer value, Layer source, Layer destination, float source_alpha, vec3 light) {
    // parts of the value itself, and of its product with the source or the destination
    float kept = 0.0, multiplied = 0.0;
    switch (factor) {
    case BLEND_ONE: case BLEND_DST_ALPHA: kept = 1.0; break;
    case BLEND_DST_COLOR: case BLEND_SRC_COLOR: multiplied = 1.0; break;
    case BLEND_ONE_MINUS_DST_COLOR: case BLEND_ONE_MINUS_SRC_COLOR: kept = 1.0; multiplied = -1.0; break;
    case BLEND_SRC_ALPHA: kept = source_alpha; break;
    case BLEND_ONE_MINUS_SRC_ALPHA: kept = 1.0 - source_alpha; break;
    } // ZERO, ONE_MINUS_DST_ALPHA, SRC_ALPHA_SATURATE: nothing
    Layer r = layer_scale(value, kept);
    if (multiplied == 0.0) return r;
    bool by_source = factor == BLEND_SRC_COLOR || factor == BLEND_ONE_MINUS_SRC_COLOR;
    if (!by_source) source = destination;
    return layer_add(r, layer_scale(layer_product(value, source, light), multiplied));
}

// A displayed part in linear light. Most parts of most layers are zero.
vec3 linear_part(vec3 displayed) { return displayed == vec3(0.0) ? vec3(0.0) : decode_display(max(displayed, 0.0)); }

// Mean of an environment image: its smallest mip level.
vec4 environment_mean(Stage stage, SurfacePoint p) {
    uint image = stage_image(VIEW.materials, stage, NO_TEXTURE, p.stage.time);
    return textureLod(sampler2D(textures[nonuniformEXT(image)], samplers[nonuniformEXT(stage.sampler_index)]), vec2(0.5), 32.0);
}

// Treatment of reflections: a ray follows them; where paths end, environment images replace them; on paths of bounced
// light, a ray may follow them, and coordinates that depend on the camera are replaced by the image's mean.
const uint SEEN_FOLLOWED = 0, SEEN_LAST = 1, SEEN_BOUNCED = 2;

// Evaluates the stages of a material over the background, in displayed values.
//
// An environment image that its author lit (`STAGE_GLOSS`) has two parts. The specular part mirrors the surroundings,
// scaled by the image's mean. The rough part gathers light from all around and shows it through the image, like a
// texture. A mirror alone would be much too dark: the image shows surroundings in full light and includes their albedo,
// which the mirrored ray applies once more. On panes the lit image is a haze over the background (`STAGE_HAZE`) with
// the light that the engine shows there: as a lit surface it would compete with the other lit layers of the pixel.
Layer run_stages(Material material, SurfacePoint p, Footprint footprint, uint seen) {
    bool world = (p.triangle.flags & TRIANGLE_WORLD) != 0;
    if (material.plain_image != NO_TEXTURE && (world || (material.flags & MATERIAL_VERTEX_LIGHT) == 0)) {
        // shortcut for the many materials that are one image under light; same result as the loop below
        return Layer(plain_texel(material, p, footprint).rgb, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    }
    if ((material.flags & MATERIAL_CLEAR) != 0)
        return Layer(vec3(0.0), vec3(0.0), encode_display(material.dielectric.filter_color), vec3(0.0), vec3(0.0));
    if ((material.flags & MATERIAL_PLAIN) != 0) seen = SEEN_LAST;
    Instance instance = instance_of(p.instance);
    Stages stages = Stages(VIEW.materials.stages);
    Layer layer = Layer(vec3(0.0), vec3(0.0), vec3(1.0), vec3(0.0), vec3(0.0));
    for (uint i = 0; i < material.stage_count; i++) {
        Stage stage = stages.at[material.stage_first + i];
        // light styles are light sources in the traced look
        if ((stage.flags & STAGE_LIGHT_STYLE) != 0) continue;
        vec4 color = stage_color(VIEW.materials, stage, instance, p.stage);
        Layer source = layer_nothing();
        bool lights_haze = false;
        float alpha;
        bool lightmap = stage.image_count == 0 && (stage.flags & STAGE_WHITE) == 0;
        if (lightmap || (stage.flags & STAGE_BAKED_LIGHT) != 0) {
            // baked light stands for light itself, scaled by the stage. Without a lightmap, primary rays show the
            // engine's white image; this light falls on nothing else, as when the map was compiled
            if ((stage.flags & STAGE_NO_LIGHTMAP) != 0 && seen != SEEN_BOUNCED) source.emission = color.rgb;
            else source.lit = color.rgb;
            alpha = color.a;
        } else {
            bool baked = world && (material.flags & MATERIAL_VERTEX_LIGHT) != 0
                && (stage.rgb_gen == RGBGEN_VERTEX || stage.rgb_gen == RGBGEN_EXACT_VERTEX);
            bool mirrors = (stage.flags & STAGE_REFLECTION) != 0, gloss = (stage.flags & STAGE_GLOSS) != 0;
            bool haze = (stage.flags & STAGE_HAZE) != 0 && seen != SEEN_BOUNCED;
            // vertex light on a reflection under a lightmap is not light that falls on it once more: it is the author's
            // mask of the reflection
            bool is_lit = stage.rgb_gen == RGBGEN_LIGHTING_DIFFUSE || (baked && !(mirrors && p.triangle.lightmap != NO_TEXTURE));
            // environment coordinates depend on the camera, so bounces use the mean
            vec4 mean = mirrors ? environment_mean(stage, p) : vec4(0.0);
            vec4 texel = mirrors && !haze && (!gloss || seen == SEEN_BOUNCED) ? mean : stage_texel(stage, p, instance, footprint);
            vec3 image = texel.rgb;
            alpha = texel.a * (stage.rgb_gen == RGBGEN_LIGHTING_DIFFUSE && stage.alpha_gen == ALPHAGEN_IDENTITY ? 1.0 : color.a);
            // the reflection brings its own light
            if (mirrors && seen != SEEN_LAST) source.reflected = mean.rgb * (is_lit ? vec3(1.0) : color.rgb);
            if (haze) {
                source.haze = is_lit ? image : image * color.rgb;
                lights_haze = is_lit;
            } else if (mirrors && !gloss) {
                if (seen == SEEN_LAST) source.emission = image * color.rgb;
            } else if (is_lit) {
                source.lit = image;
            } else {
                vec3 shown = image * color.rgb;
                bool matter = !world && (stage.flags & STAGE_MATTER) != 0;
                if (matter && (material.flags & MATERIAL_POLYGON_OFFSET) != 0) {
                    source.lit = shown; // a mark shares the light of its surface
                } else {
                    // a sprite takes the light grid's light as emission
                    if (matter && (instance.flags & INSTANCE_SUSPENDED) != 0) shown *= instance.ambient;
                    source.emission = shown;
                }
            }
        }
        if (stage.alpha_func != ALPHAFUNC_NONE && !alpha_passes(stage.alpha_func, alpha)) continue;
        bool lights_background = source.lit != vec3(0.0) && (layer.through != vec3(0.0) || layer.haze != vec3(0.0));
        vec3 light = lights_haze || lights_background ? displayed_light(p) : vec3(1.0);
        if (lights_haze) source.haze *= light;
        layer = layer_add(layer_blend(stage.blend_src, source, source, layer, alpha, light),
            layer_blend(stage.blend_dst, layer, source, layer, alpha, light));
    }
    return layer;
}

// Albedo of a material: at most 1, unless the stages themselves exceed it.
vec3 bounded_albedo(Material material, vec3 lit) {
    return material.lit_scale != 1.0 ? min(lit * material.lit_scale, max(lit, 1.0)) : lit;
}

// Emission by the material's emissive map, linear.
vec3 glow_map(SurfacePoint p, Material material, Footprint footprint) {
    if ((material.flags & MATERIAL_GLOWS) == 0 || (VIEW.flags & VIEW_FULLBRIGHT) != 0) return vec3(0.0);
    vec3 texel = map_texel(material.specular, material.specular.glow, p, footprint).rgb;
    return decode_display(texel) * material.specular.glow_radiance;
}

// Gives the sharply mirrored part of the light, which a file of materials states, from the diffuse to the mirrored part.
void take_mirror(Material material, inout Layer layer) {
    if ((material.flags & MATERIAL_REFLECTS) == 0 || material.specular.mirror == vec3(0.0) || (VIEW.flags & VIEW_FULLBRIGHT) != 0) return;
    layer.lit *= 1.0 - material.specular.mirror;
    layer.reflected = max(layer.reflected, material.specular.mirror);
}

// Parts of the point's stages on a path of bounced light, each by itself in linear light.
Layer evaluate_stages(SurfacePoint p, Footprint footprint) {
    Material material = material_of(p.triangle.material);
    Layer shown = run_stages(material, p, footprint, SEEN_BOUNCED);
    Layer layer = Layer(bounded_albedo(material, linear_part(shown.lit)), linear_part(shown.emission), linear_part(shown.through),
        linear_part(shown.reflected), vec3(0.0));
    take_mirror(material, layer);
    layer.emission += glow_map(p, material, footprint);
    return layer;
}

// Emission that an emitter displays: its texture at up to full brightness.
vec3 shown_glow(Material material) {
    if ((material.flags & MATERIAL_GLOWS) != 0) return vec3(0.0); // its map shows it
    vec3 radiance = material.light_radiance;
    return radiance / (1.0 + max_component(radiance));
}

// Light that the engine adds to models, so that players see weapons and each other in the dark; linear. It is added in
// displayed values, so its linear value grows with the light. It lights nothing else.
vec3 added_light(SurfacePoint p) {
    if ((p.triangle.flags & TRIANGLE_WORLD) != 0 || (VIEW.flags & VIEW_FULLBRIGHT) != 0) return vec3(0.0);
    Instance instance = instance_of(p.instance);
    if ((instance.flags & INSTANCE_UNLIT) != 0) return vec3(0.0);
    vec3 displayed = grid_light(p, instance);
    return decode_display(min(displayed + instance.added, vec3(1.0))) - decode_display(displayed);
}

#endif
