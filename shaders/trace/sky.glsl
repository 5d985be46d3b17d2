// Sky radiance by direction: the box of six images, cloud stages on a sphere around the world, image of the sun.
#ifndef RELIGHT_TRACE_SKY_GLSL
#define RELIGHT_TRACE_SKY_GLSL

#include "trace/layer.glsl"

// Box face and image coordinates of a direction. Faces: +X rt, +Y bk, -X lf, -Y ft, +Z up, -Z dn.
void sky_face(vec3 d, out uint face, out vec2 uv) {
    vec3 m = abs(d);
    vec2 st;
    if (m.x >= m.y && m.x >= m.z) {
        face = d.x > 0.0 ? 0u : 2u;
        st = vec2(d.x > 0.0 ? -d.y : d.y, d.z) / m.x;
    } else if (m.y >= m.z) {
        face = d.y > 0.0 ? 1u : 3u;
        st = vec2(d.y > 0.0 ? d.x : -d.x, d.z) / m.y;
    } else {
        face = d.z > 0.0 ? 4u : 5u;
        st = vec2(-d.y, d.z > 0.0 ? -d.x : d.x) / m.z;
    }
    uv = vec2(st.x * 0.5 + 0.5, 0.5 - st.y * 0.5);
}

// The inverse: the point of the box [-1, 1]^3.
vec3 sky_point(uint face, vec2 uv) {
    vec2 st = vec2(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0);
    switch (face) {
    case 0u: return vec3(1.0, -st.x, st.y);
    case 1u: return vec3(st.x, 1.0, st.y);
    case 2u: return vec3(-1.0, st.x, st.y);
    case 3u: return vec3(-st.x, -1.0, st.y);
    case 4u: return vec3(-st.y, -st.x, 1.0);
    default: return vec3(st.y, -st.x, -1.0);
    }
}

// Texture coordinates of the clouds: the point where the direction meets a sphere of radius 4096 + height around a
// centre 4096 below the camera; the arc cosines of its unit vector.
vec2 cloud_uv(vec3 d, float height) {
    const float radius = 4096.0;
    float along = -d.z * radius + sqrt(max(d.z * d.z * radius * radius + 2.0 * radius * height + height * height, 0.0));
    vec3 v = normalize(d * along + vec3(0.0, 0.0, radius));
    return acos(clamp(v.xy, -1.0, 1.0));
}

// Change of these coordinates with the direction: the geometric mean of both axes, by differences. Overhead, where the
// sphere is near, it is a few times smaller than at the horizon.
float cloud_scale(vec3 d, vec2 uv, float height) {
    const float step_d = 1.0 / 128.0;
    vec3 aside = normalize(abs(d.z) < 0.9 ? vec3(-d.y, d.x, 0.0) : vec3(d.z, 0.0, -d.x));
    vec2 along_x = cloud_uv(normalize(d + aside * step_d), height) - uv;
    vec2 along_y = cloud_uv(normalize(d + cross(d, aside) * step_d), height) - uv;
    return sqrt(abs(along_x.x * along_y.y - along_x.y * along_y.x)) / step_d;
}

// A blend factor, as displayed. The frame buffer's alpha reads as one.
vec3 displayed_factor(uint factor, vec4 source, vec3 destination) {
    switch (factor) {
    case BLEND_ONE: case BLEND_DST_ALPHA: return vec3(1.0);
    case BLEND_DST_COLOR: return destination;
    case BLEND_ONE_MINUS_DST_COLOR: return 1.0 - destination;
    case BLEND_SRC_COLOR: return source.rgb;
    case BLEND_ONE_MINUS_SRC_COLOR: return 1.0 - source.rgb;
    case BLEND_SRC_ALPHA: return vec3(source.a);
    case BLEND_ONE_MINUS_SRC_ALPHA: return vec3(1.0 - source.a);
    default: return vec3(0.0); // ZERO, ONE_MINUS_DST_ALPHA, SRC_ALPHA_SATURATE
    }
}

// Whether the engine's fog reduces what a material adds to the display, by the blending of its first stage.
bool fades_in_fog(Material material) {
    if (material.stage_count == 0) return false;
    Stage stage = Stages(VIEW.materials.stages).at[material.stage_first];
    uint source = stage.blend_src, target = stage.blend_dst;
    if (target == BLEND_ONE_MINUS_SRC_ALPHA) return source == BLEND_SRC_ALPHA || source == BLEND_ONE;
    return (source == BLEND_ONE && target == BLEND_ONE) || (source == BLEND_ZERO && target == BLEND_ONE_MINUS_SRC_COLOR);
}

// A blended stage behind fog that leaves `clear` of it.
vec4 faded(Stage stage, vec4 source, float clear) {
    if (stage.blend_dst == BLEND_ONE_MINUS_SRC_ALPHA && stage.blend_src == BLEND_SRC_ALPHA) return vec4(source.rgb, source.a * clear);
    if (stage.blend_dst == BLEND_ONE_MINUS_SRC_ALPHA && stage.blend_src == BLEND_ONE) return source * clear;
    bool fades = (stage.blend_src == BLEND_ONE && stage.blend_dst == BLEND_ONE)
        || (stage.blend_src == BLEND_ZERO && stage.blend_dst == BLEND_ONE_MINUS_SRC_COLOR);
    return fades ? vec4(source.rgb * clear, source.a) : source;
}

// Stages of clouds or of the sun over `below`, behind fog that leaves `clear` of them. No light falls on a sky: its
// stages are blended in displayed values, as in the engine.
vec3 displayed_stages(SurfacePoint p, Footprint width, vec3 below, float clear) {
    Material material = material_of(p.triangle.material);
    Instance instance = instance_of(p.instance);
    Stages stages = Stages(VIEW.materials.stages);
    for (uint i = 0; i < material.stage_count; i++) {
        Stage stage = stages.at[material.stage_first + i];
        vec4 source = clamp(stage_color(VIEW.materials, stage, instance, p.stage) * stage_texel(stage, p, instance, width), 0.0, 1.0);
        if (stage.alpha_func != ALPHAFUNC_NONE && !alpha_passes(stage.alpha_func, source.a)) continue;
        source = faded(stage, source, clear);
        below = clamp(source.rgb * displayed_factor(stage.blend_src, source, below)
            + below * displayed_factor(stage.blend_dst, source, below), 0.0, 1.0);
    }
    return below;
}

// Whether clouds cover the direction; `p` becomes their point in it.
bool clouds_at(inout SurfacePoint p, vec3 d, uint face, float height) {
    if (face == 5u || material_of(p.triangle.material).stage_count == 0) return false;
    p.stage.st = cloud_uv(d, height);
    p.stage.lightmap = p.stage.st;
    p.triangle.lightmap = NO_TEXTURE;
    p.texel_scale = cloud_scale(d, p.stage.st, height);
    return true;
}

// Whether the image of the sun covers the direction; `p` becomes its point in it.
bool sun_at(inout SurfacePoint p, vec3 d) {
    SunDisc sun = VIEW.scene.sun;
    float ahead = dot(d, sun.direction);
    if (sun.material == NO_TEXTURE || ahead <= 0.0) return false;
    vec3 up = cross(sun.direction, sun.left);
    vec2 place = vec2(dot(d, sun.left), dot(d, up)) / (ahead * sun.size);
    if (max(abs(place.x), abs(place.y)) > 1.0) return false;
    p.triangle.material = sun.material;
    p.triangle.lightmap = NO_TEXTURE;
    p.stage.st = 0.5 - 0.5 * place;
    p.stage.color = vec4(1.0);
    p.stage.time = shader_time(material_of(sun.material), instance_of(p.instance));
    p.texel_scale = 0.5 / sun.size;
    return true;
}

// Radiance of the sky in direction d. `p`: point on the sky surface; its lightmap index is the index of the sky.
// `with_sun`: includes the image of the sun, which is visible but emits nothing: a `SunLight` does. `fog`: displayed
// colour of the fog over the clouds, and its share.
vec3 sky_radiance(SurfacePoint p, vec3 d, float spread, bool with_sun, vec4 fog) {
    if ((VIEW.flags & VIEW_FAST_SKY) != 0) return vec3(0.0);
    SkyRecord sky = Skies(VIEW.scene.skies).at[p.triangle.lightmap];
    uint face;
    vec2 uv;
    sky_face(d, face, uv);
    vec3 color = vec3(0.0);
    uint image = sky.faces[face];
    if (image != NO_TEXTURE) {
        vec2 size = vec2(textureSize(textures[nonuniformEXT(image)], 0));
        float lod = max(log2(max(spread * 0.5 * max(size.x, size.y), 1.0e-6)), 0.0);
        color = textureLod(sampler2D(textures[nonuniformEXT(image)], samplers[VIEW.scene.sky_sampler]), uv, lod).rgb;
    }
    // drivers inline functions: in a loop the stages are compiled once
    for (uint picture = 0; picture < (with_sun ? 2 : 1); picture++) {
        bool covers = picture == 0 ? clouds_at(p, d, face, sky.cloud_height) : sun_at(p, d);
        if (!covers) continue;
        float cover = picture == 0 ? fog.a : 0.0;
        float clear = fades_in_fog(material_of(p.triangle.material)) ? 1.0 - cover : 1.0;
        color = mix(displayed_stages(p, round_footprint(spread), color, clear), fog.rgb, cover);
    }
    return decode_display(color);
}

#endif
