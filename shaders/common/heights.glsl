// Heights in the alpha of normal maps, for both looks: where a ray of sight meets them.
// Source: `RayIntersectDisplaceMap` in `lightall_fp.glsl` of ioquake3's `opengl2`.
#ifndef RELIGHT_HEIGHTS_GLSL
#define RELIGHT_HEIGHTS_GLSL

#include "common/bindless.glsl"
#include "common/tangent_space.glsl"

const uint HEIGHT_STEPS = 16;
const uint HEIGHT_HALVINGS = 6;

// Depth below the surface, of 1, of a place in the texture.
float height_depth(uint map, uint map_sampler, vec2 uv, float lod) {
    return 1.0 - textureLod(sampler2D(textures[nonuniformEXT(map)], samplers[nonuniformEXT(map_sampler)]), uv, lod).a;
}

// Offset of the texture coordinates to the place that a ray meets, which enters the surface at `uv` and is at `uv` + `slope`
// at depth 1. `relief`: halves the last step, as `r_parallaxMapping 2` does; otherwise it is interpolated, from the end of the
// step and not from its begin, as there.
vec2 height_offset(uint map, uint map_sampler, vec2 uv, vec2 slope, float lod, bool relief) {
    float size = 1.0 / float(HEIGHT_STEPS), found = 1.0, below = 0.0;
    float last = height_depth(map, map_sampler, uv, lod), above = last;
    for (uint i = 1; i < HEIGHT_STEPS; i++) {
        float depth = float(i) * size;
        float met = height_depth(map, map_sampler, uv + slope * depth, lod);
        if (depth >= met) {
            found = depth;
            below = met;
            above = last;
            break;
        }
        last = met;
    }
    if (!relief) return slope * (found - (found - size - above) / (1.0 + (above - below) * float(HEIGHT_STEPS)));
    float depth = found;
    for (uint i = 0; i < HEIGHT_HALVINGS; i++) {
        size *= 0.5;
        bool inside = depth >= height_depth(map, map_sampler, uv + slope * depth, lod);
        if (inside) found = depth;
        depth += inside ? -size : size;
    }
    return slope * found;
}

// Least cosine of a ray of sight: the slope of grazing ones is bounded.
const float LEAST_HEIGHT_COSINE = 1.0e-3;

// Change of the texture coordinates of a ray down to `depth`. `to_viewer`, `normal`: unit, on the same side; `tangent`,
// `along_t`: as for `normal_from_map`.
vec2 height_slope(vec3 to_viewer, vec3 normal, vec3 tangent, vec3 along_t, float depth) {
    tangent = safe_normalize(tangent - normal * dot(normal, tangent), vec3(0.0));
    vec3 bitangent = cross(normal, tangent);
    if (dot(bitangent, along_t) < 0.0) bitangent = -bitangent;
    return vec2(dot(to_viewer, tangent), dot(to_viewer, bitangent)) * (-depth / max(dot(to_viewer, normal), LEAST_HEIGHT_COSINE));
}

#endif
