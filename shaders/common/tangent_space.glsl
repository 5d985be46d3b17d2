// Normals from normal maps, for both looks.
#ifndef RELIGHT_TANGENT_SPACE_GLSL
#define RELIGHT_TANGENT_SPACE_GLSL

#extension GL_EXT_buffer_reference2 : require
#include "generated/types.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MappedVertices { MappedVertex at[]; };

vec3 safe_normalize(vec3 v, vec3 otherwise) {
    float squared = dot(v, v);
    return squared > 1.0e-30 ? v * inversesqrt(squared) : otherwise;
}

// The mapped normal of a point. `tangent`: in the direction of texture coordinate s; `along_t`: in that of t; neither need be
// of unit length or perpendicular to `normal`. `texel`: first two components of the map, 0 to 1; the third follows from
// them, as in `opengl2`.
vec3 normal_from_map(vec3 normal, vec3 tangent, vec3 along_t, vec2 texel, vec2 scale) {
    tangent = safe_normalize(tangent - normal * dot(normal, tangent), vec3(0.0));
    if (tangent == vec3(0.0)) return normal;
    // t points down in texture coordinates, up in normal maps
    vec3 up = cross(normal, tangent);
    if (dot(up, along_t) > 0.0) up = -up;
    vec2 along = (texel * 2.0 - 1.0) * scale;
    return safe_normalize(tangent * along.x + up * along.y + normal * sqrt(max(1.0 - dot(along, along), 0.0)), normal);
}

#endif
