// Specular reflection of rough surfaces: microfacets with the GGX distribution (Walter et al., Microfacet Models for
// Refraction through Rough Surfaces, 2007), Smith's height-correlated masking and shadowing (Heitz, Understanding the
// Masking-Shadowing Function, JCGT 3(2), 2014), Schlick's approximation of Fresnel's factor, and light that is reflected
// several times between microfacets as a factor of the single reflection (Turquin, Practical Multiple Scattering
// Compensation for Microfacet Models, 2019). What the specular part reflects, the diffuse part below does not get.
#ifndef RELIGHT_TRACE_SPECULAR_GLSL
#define RELIGHT_TRACE_SPECULAR_GLSL

#include "common/heights.glsl"
#include "trace/layer.glsl"

// 1: materials reflect by their roughness. 0 removes the code.
layout(constant_id = 3) const uint HAS_GLOSS = 0;
// 1: heights of normal maps move the textures that rays of sight meet.
layout(constant_id = 20) const uint HAS_HEIGHTS = 0;

// Specular reflection at a point. `reflectance`: at normal incidence; `alpha`: width of the distribution, 0: none.
struct Gloss {
    vec3 reflectance;
    float alpha;
};

const Gloss NO_GLOSS = Gloss(vec3(0.0), 0.0);

// Smallest roughness: below it, the lobe is narrower than the precision of packed directions.
const float LEAST_ROUGHNESS = 0.045;
// Smallest cosine to the view: interpolated and mapped normals may turn away from it.
const float LEAST_COSINE = 0.02;

bool is_glossy(Gloss gloss) { return gloss.alpha > 0.0; }

// Specular albedo for a white environment. `cosine`: to the view. Interpolated in a table, without compensation; `whole`:
// the albedo of a surface that reflects all light at once.
vec3 single_albedo(Gloss gloss, float cosine, out float whole) {
    const float LAST = float(SPECULAR_TABLE - 1);
    vec2 at = clamp(vec2(sqrt(clamp(cosine, 0.0, 1.0)), sqrt(gloss.alpha)) * LAST, 0.0, LAST);
    uvec2 low = min(uvec2(at), SPECULAR_TABLE - 2);
    vec2 part = at - vec2(low);
    Pairs table = Pairs(VIEW.transport.specular_albedo);
    uint row = low.y * SPECULAR_TABLE + low.x;
    vec2 upper = mix(table.at[row], table.at[row + 1], part.x);
    vec2 lower = mix(table.at[row + SPECULAR_TABLE], table.at[row + SPECULAR_TABLE + 1], part.x);
    vec2 terms = mix(upper, lower, part.y);
    whole = terms.x + terms.y;
    return gloss.reflectance * terms.x + terms.y;
}

// Factor for light that is reflected several times.
vec3 compensation(Gloss gloss, float whole) { return 1.0 + gloss.reflectance * (1.0 / max(whole, 1.0e-3) - 1.0); }

// Part of a white environment's light that the point reflects.
vec3 specular_albedo(Gloss gloss, float cosine) {
    float whole;
    vec3 single = single_albedo(gloss, cosine, whole);
    return min(single * compensation(gloss, whole), 1.0);
}

// Parts of the square of `alpha`.
float distribution(float alpha, float cosine) {
    float a = alpha * alpha, d = cosine * cosine * (a - 1.0) + 1.0;
    return a / (PI * d * d);
}

float smith_lambda(float alpha, float cosine) {
    float c = cosine * cosine;
    return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 - c) / max(c, 1.0e-12)) - 1.0);
}

vec3 schlick(vec3 reflectance, float cosine) {
    float away = clamp(1.0 - cosine, 0.0, 1.0), squared = away * away;
    return reflectance + (1.0 - reflectance) * (squared * squared * away);
}

// A view of a glossy point: its normal, turned so that the view lies above it, and the direction to the viewer.
struct GlossView {
    vec3 normal;
    vec3 to_viewer;
    float cosine;
};

GlossView gloss_view(vec3 normal, vec3 to_viewer) {
    float cosine = dot(normal, to_viewer);
    if (cosine < LEAST_COSINE) {
        normal = normalize(normal + to_viewer * (LEAST_COSINE - cosine));
        cosine = max(dot(normal, to_viewer), LEAST_COSINE);
    }
    return GlossView(normal, to_viewer, cosine);
}

// Density with which `gloss_direction` samples a direction, per solid angle.
float gloss_density(Gloss gloss, GlossView view, vec3 direction) {
    vec3 half_way = safe_normalize(view.to_viewer + direction, view.normal);
    float masking = 1.0 / (1.0 + smith_lambda(gloss.alpha, view.cosine));
    return distribution(gloss.alpha, dot(view.normal, half_way)) * masking / (4.0 * view.cosine);
}

// Reflectance of the point between two directions times the cosine, over the density of `gloss_direction`.
vec3 gloss_weight(Gloss gloss, GlossView view, vec3 direction) {
    float leaving = dot(view.normal, direction);
    if (leaving <= 0.0) return vec3(0.0);
    vec3 half_way = safe_normalize(view.to_viewer + direction, view.normal);
    float lambda = smith_lambda(gloss.alpha, view.cosine);
    float shadowing = (1.0 + lambda) / (1.0 + lambda + smith_lambda(gloss.alpha, leaving));
    float whole;
    single_albedo(gloss, view.cosine, whole);
    return schlick(gloss.reflectance, dot(view.to_viewer, half_way)) * compensation(gloss, whole) * shadowing;
}

// Samples a microfacet's normal by the distribution of visible normals (Dupuy and Benyoub, Sampling Visible GGX Normals
// with Spherical Caps, 2023). `normal`: on the side of `to_viewer`.
vec3 sample_facet(float alpha, vec3 normal, vec3 to_viewer, vec2 u) {
    vec3 t, b;
    basis(normal, t, b);
    vec3 seen = vec3(dot(to_viewer, t), dot(to_viewer, b), dot(to_viewer, normal));
    vec3 stretched = normalize(vec3(seen.xy * alpha, seen.z));
    float phi = 2.0 * PI * u.x, z = fma(1.0 - u.y, 1.0 + stretched.z, -stretched.z);
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    vec3 facet = vec3(r * cos(phi), r * sin(phi), z) + stretched;
    facet = normalize(vec3(facet.xy * alpha, max(facet.z, 1.0e-6)));
    return t * facet.x + b * facet.y + normal * facet.z;
}

// Samples a direction of reflected light. It may lead into the surface; its weight is 0 then.
vec3 gloss_direction(Gloss gloss, GlossView view, vec2 u) {
    return normalize(reflect(-view.to_viewer, sample_facet(gloss.alpha, view.normal, view.to_viewer, u)));
}

// The gloss of a point, of its part that is no metal; `metal`: the other part.
Gloss body_gloss(SurfacePoint p, Material material, Footprint footprint, out float metal) {
    Specular specular = material.specular;
    metal = specular.metal;
    vec4 map = vec4(1.0);
    if (specular.map != NO_TEXTURE) map = map_texel(specular, specular.map, p, footprint);
    vec3 reflectance = specular.reflectance;
    float rough;
    if ((material.flags & MATERIAL_SPECULAR_MAP) != 0) {
        reflectance *= decode_display(map.rgb);
        rough = 1.0 - map.a * (1.0 - specular.roughness);
    } else {
        rough = specular.roughness * map.g;
        metal *= map.b;
    }
    rough = max(rough, LEAST_ROUGHNESS);
    return Gloss(reflectance, rough * rough);
}

// Tangent of a point along s, and `along_t`: the direction in which t grows. Vertices of the map have MikkTSpace's tangents;
// on what moves the tangent is the triangle's.
vec3 surface_tangent(SurfacePoint p, out vec3 along_t) {
    TraceVertices vertices = TraceVertices(p.vertices);
    uvec3 corners = uvec3(p.triangle.indices[0], p.triangle.indices[1], p.triangle.indices[2]);
    Vertex a = vertices.at[corners.x], b = vertices.at[corners.y], c = vertices.at[corners.z];
    Instance instance = instance_of(p.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
    vec3 ab = axis * (b.position - a.position), ac = axis * (c.position - a.position);
    vec2 sb = b.st - a.st, sc = c.st - a.st;
    float turn = sign(sb.x * sc.y - sb.y * sc.x);
    along_t = (ac * sb.x - ab * sc.x) * turn;
    if (VIEW.scene.mapped_vertices != 0 && (p.triangle.flags & TRIANGLE_STATIC) != 0) {
        MappedVertices mapped = MappedVertices(VIEW.scene.mapped_vertices);
        vec3 tangent = mapped.at[corners.x].tangent * p.weights.x + mapped.at[corners.y].tangent * p.weights.y + mapped.at[corners.z].tangent * p.weights.z;
        if (tangent != vec3(0.0)) return axis * tangent;
    }
    return (ab * sc.y - ac * sb.y) * turn;
}

// Moves the texture coordinates of a point of the map to the place where a ray of sight meets the heights of its normal map.
void move_by_heights(inout SurfacePoint p, Material material, Footprint footprint, vec3 direction) {
    if (HAS_HEIGHTS == 0 || (material.flags & MATERIAL_HEIGHTS) == 0 || (p.triangle.flags & TRIANGLE_STATIC) == 0) return;
    Specular specular = material.specular;
    vec3 along_t;
    vec3 tangent = surface_tangent(p, along_t);
    vec3 normal = dot(p.normal, direction) > 0.0 ? -p.normal : p.normal;
    vec2 slope = height_slope(-direction, normal, tangent, along_t, specular.depth);
    mat2 jacobian;
    vec2 uv = map_texcoord(specular, p, jacobian);
    float area = determinant(jacobian);
    float lod = texture_lod(specular.normals, p.texel_scale * sqrt(abs(area)), footprint.width);
    vec2 shift = height_offset(specular.normals, specular.sampler_index, uv, slope, lod, (VIEW.flags & VIEW_RELIEF) != 0);
    if (area != 0.0) p.stage.st += inverse(jacobian) * shift;
}

// The shading normal of a point, on the side of its face: from the normal map, if the material has one.
vec3 mapped_normal(SurfacePoint p, Material material, Footprint footprint) {
    Specular specular = material.specular;
    if (HAS_GLOSS == 0 || (material.flags & MATERIAL_NORMALS) == 0) return p.normal;
    vec3 along_t;
    vec3 tangent = surface_tangent(p, along_t);
    vec2 texel = map_texel(specular, specular.normals, p, footprint).xy;
    return normal_from_map(p.normal, tangent, along_t, texel, specular.normal_scale);
}

// Gives the specular part of the light that reaches a layer to the result, and the rest to its diffuse part `lit`.
// `direction`: of the ray that meets the point; `lobe_albedo`: specular albedo.
Gloss take_gloss(SurfacePoint p, Material material, Footprint footprint, vec3 direction, inout vec3 lit, out vec3 lobe_albedo) {
    lobe_albedo = vec3(0.0);
    if (HAS_GLOSS == 0 || (material.flags & MATERIAL_ROUGH) == 0 || p.kind == KIND_TRANSLUCENT) return NO_GLOSS;
    float metal;
    Gloss body = body_gloss(p, material, footprint, metal);
    Gloss gloss = Gloss(mix(body.reflectance, clamp(lit, 0.0, 1.0), metal), body.alpha);
    vec3 face = dot(p.face_normal, direction) > 0.0 ? -p.face_normal : p.face_normal;
    GlossView view = gloss_view(dot(p.normal, face) < 0.0 ? -p.normal : p.normal, -direction);
    lobe_albedo = specular_albedo(gloss, view.cosine);
    vec3 whole = lit, of_body = specular_albedo(body, view.cosine);
    lit *= (1.0 - metal) * (1.0 - of_body);
    if (metal > 0.0 && metal < 1.0) {
        // a mixture has one lobe; what both lobes would reflect beyond it is scattered
        vec3 of_metal = specular_albedo(Gloss(clamp(whole, 0.0, 1.0), body.alpha), view.cosine);
        lit += max(mix(of_body, of_metal, metal) - lobe_albedo, 0.0);
    }
    return gloss;
}

#endif
