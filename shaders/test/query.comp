#version 460
// Test of the gpu layer: see rays.glsl.
#extension GL_EXT_ray_query : require
#include "rays.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= size || pixel.y >= size) return;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scenes[scene], gl_RayFlagsNoneEXT, 0xff, origin_of(pixel), 0.0, vec3(0, 0, -1), 10.0);
    while (rayQueryProceedEXT(query)) {
        if (!hole(rayQueryGetIntersectionBarycentricsEXT(query, false))) rayQueryConfirmIntersectionEXT(query);
    }
    uvec4 result = uvec4(0);
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
        bool front = rayQueryGetIntersectionFrontFaceEXT(query, true);
        result = uvec4(1, rayQueryGetIntersectionInstanceCustomIndexEXT(query, true),
            rayQueryGetIntersectionPrimitiveIndexEXT(query, true), front ? 254 : 255);
    }
    hits.at[pixel.y * size + pixel.x] = result;
}
