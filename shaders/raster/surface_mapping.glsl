// Normal and specular mapping of a draw, under the baked light of a surface or the light of the grid on a model.
// Source: `lightall_fp.glsl` and `lightall_vp.glsl` of ioquake3's `opengl2`, without cube maps.
#include "common/heights.glsl"

// Part of the baked light that has the direction of `in_light`; the rest has none.
const float DIRECTED_PART = 0.75;
// The directed part is divided by the cosine at which the baked light arrived, at least by this.
const float LEAST_INCIDENCE = 0.25;
// `r_deluxeSpecular`, its default: exponent of the roughness under baked light, factor of the highlight under the grid's.
const float HIGHLIGHT = 0.3;
// The lobe of less roughness is smaller than a pixel.
const float LEAST_ROUGHNESS = 0.05;

vec2 texture_uv() { return (TEXTURE_STAGE & 1) == 0 ? in_uv[TEXTURE_STAGE / 2].xy : in_uv[TEXTURE_STAGE / 2].zw; }

vec4 map_texel(uint map, uint map_sampler) {
    vec2 uv = texture_uv();
    if ((MAPPING & MAPPING_HEIGHTS) != 0) uv += height_shift;
    return texture(sampler2D(textures[map], samplers[map_sampler]), uv);
}

vec3 vector_to_viewer() { return vec3(in_normal.w, in_tangent.w, in_light.w); }

// The interpolated normal, on the side that is seen.
vec3 flat_normal_of(vec3 to_viewer, vec3 view) {
    vec3 face = cross(dFdx(to_viewer), dFdy(to_viewer));
    if (dot(face, view) < 0.0) face = -face;
    vec3 flat_normal = safe_normalize(in_normal.xyz, safe_normalize(face, view));
    return dot(flat_normal, face) < 0.0 ? -flat_normal : flat_normal;
}

// Tangent of the vertices, or else of the triangle, and `along_t`: where t grows.
vec3 tangent_of(vec3 to_viewer, out vec3 along_t) {
    vec3 px = -dFdx(to_viewer), py = -dFdy(to_viewer);
    vec2 sx = dFdx(texture_uv()), sy = dFdy(texture_uv());
    float turn = sign(sx.x * sy.y - sx.y * sy.x);
    vec3 along_s = (px * sy.y - py * sx.y) * turn;
    along_t = (py * sx.x - px * sy.x) * turn;
    return in_tangent.xyz == vec3(0.0) ? along_s : in_tangent.xyz;
}

// How far the heights of the normal map move the texture.
vec2 shift_by_heights() {
    Specular specular = Materials(VIEW.materials.materials).at[Draws(VIEW.draws).at[in_textures.x].material].specular;
    vec3 to_viewer = vector_to_viewer(), along_t;
    vec3 view = safe_normalize(to_viewer, vec3(0.0, 0.0, 1.0));
    vec3 tangent = tangent_of(to_viewer, along_t);
    vec2 slope = height_slope(view, flat_normal_of(to_viewer, view), tangent, along_t, specular.depth);
    uint map = specular.normals, map_sampler = specular.sampler_index;
    float lod = textureQueryLod(sampler2D(textures[map], samplers[map_sampler]), texture_uv()).y;
    return height_offset(map, map_sampler, texture_uv(), slope, max(lod, 0.0), (MAPPING & MAPPING_RELIEF) != 0);
}

vec3 mapped_normal(Specular specular, vec3 normal, vec3 to_viewer) {
    vec3 along_t;
    vec3 tangent = tangent_of(to_viewer, along_t);
    vec2 texel = map_texel(specular.normals, specular.sampler_index).xy;
    return normal_from_map(normal, tangent, along_t, texel, specular.normal_scale);
}

// A surface of a texture. Metal scatters as its texture would: the look reflects no surroundings, without which metal is
// black (`opengl2` has cube maps for it).
struct Reflecting {
    vec3 reflectance; // at normal incidence
    vec3 scattered;   // part of the light that the texture scatters
    float roughness;
};

Reflecting reflecting(Specular specular, uint flags, vec3 base) {
    vec4 map = specular.map == NO_TEXTURE ? vec4(1.0) : map_texel(specular.map, specular.sampler_index);
    vec3 reflectance = specular.reflectance;
    float metal = specular.metal, roughness = specular.roughness;
    if ((flags & MATERIAL_SPECULAR_MAP) != 0) {
        reflectance *= map.rgb;
        roughness = 1.0 - map.a * (1.0 - roughness);
    } else {
        metal *= map.b;
        roughness *= map.g;
    }
    return Reflecting(mix(reflectance, base, metal), 1.0 - reflectance * (1.0 - metal), roughness);
}

// A GGX lobe (`CalcSpecular`).
float lobe(float normal_half, float view_half, float roughness) {
    float alpha = roughness * roughness, squared = alpha * alpha;
    float d = normal_half * normal_half * (squared - 1.0) + 1.0;
    float v = view_half * view_half * (roughness + 0.5) + 1.0e-8;
    return squared / (4.0 * d * d * v);
}

// `color`: the texture under its light, without maps.
vec4 mapped_color(vec4 color) {
    Draws draws = Draws(VIEW.draws);
    uint draw = in_textures.x;
    Material material = Materials(VIEW.materials.materials).at[draws.at[draw].material];
    vec3 to_viewer = vector_to_viewer();
    vec3 view = safe_normalize(to_viewer, vec3(0.0, 0.0, 1.0));
    vec3 flat_normal = flat_normal_of(to_viewer, view);
    vec3 light = safe_normalize(in_light.xyz, flat_normal);
    vec3 normal = (MAPPING & MAPPING_NORMALS) == 0 ? flat_normal : mapped_normal(material.specular, flat_normal, to_viewer);
    float incidence = clamp(dot(normal, light), 0.0, 1.0);

    Reflecting surface = Reflecting(vec3(0.0), vec3(1.0), 1.0);
    if ((MAPPING & MAPPING_SPECULAR) != 0) surface = reflecting(material.specular, material.flags, sample_stage(TEXTURE_STAGE).rgb);

    vec3 whole; // light over that of `color`
    vec3 directed;
    float roughness = surface.roughness, strength = 1.0;
    if ((MAPPING & MAPPING_SOURCE) == MAPPING_OF_GRID) {
        Instance instance = Instances(VIEW.instances).at[draws.at[draw].instance];
        bool lit = (instance.flags & INSTANCE_UNLIT) == 0;
        directed = lit ? instance.directed : vec3(0.0);
        whole = (lit ? instance.ambient : vec3(0.0)) + directed * incidence;
        strength = HIGHLIGHT;
    } else {
        float baked = clamp(dot(flat_normal, light), 0.0, 1.0);
        float factor = DIRECTED_PART / max(baked, LEAST_INCIDENCE);
        whole = vec3(factor * incidence + max(1.0 - factor * baked, 0.0));
        directed = factor * stage_color(TEXTURE_STAGE).rgb;
        if (LIGHT_STAGE != 0) directed *= stage_value(LIGHT_STAGE - 1).rgb;
        roughness = pow(roughness, HIGHLIGHT);
    }
    color.rgb *= surface.scattered * whole;
    if ((MAPPING & MAPPING_SPECULAR) != 0) {
        vec3 middle = safe_normalize(light + view, normal);
        float normal_half = clamp(dot(normal, middle), 0.0, 1.0), view_half = clamp(dot(view, middle), 0.0, 1.0);
        color.rgb += directed * surface.reflectance * (lobe(normal_half, view_half, max(roughness, LEAST_ROUGHNESS)) * strength * incidence);
    }
    return color;
}

// Applies the maps to the stages up to `stage`, if these are the texture and its light.
vec4 mapped_after(uint stage, vec4 color) {
    return MAPPING != 0 && stage + 1 == max(TEXTURE_STAGE + 1, LIGHT_STAGE) ? mapped_color(color) : color;
}
