// The G-buffer: position and path (16 bytes a pixel), normals (8), albedo (8) and motion (8, see motion.glsl). The motion is kept for the
// next frame. `albedo` holds everything between the eye and the surface: the light L of the point
// is shown as albedo * L + front.
#ifndef RELIGHT_TRACE_GBUFFER_GLSL
#define RELIGHT_TRACE_GBUFFER_GLSL

#include "trace/view.glsl"

// Most new light that a pixel tells of, times the light of its front: the unit of the fraction beside the field.
const float MOST_FRESH = 8.0;

struct GBufferPixel {
    vec3 position;
    float path; // length of the way from the eye; negative: nothing to light
    vec3 face_normal;
    vec3 normal;
    vec3 albedo;
};

// Octahedral normals (Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, 2014).
uint pack_normal(vec3 n) {
    vec2 p = n.xy / max(abs(n.x) + abs(n.y) + abs(n.z), 1.0e-20);
    if (n.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return packSnorm2x16(p);
}

vec3 unpack_normal(uint packed) {
    vec2 p = unpackSnorm2x16(packed);
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return normalize(n);
}

void gbuffer_write(ivec2 pixel, GBufferPixel g) {
    imageStore(images_rgba32f[VIEW.image_position], pixel, vec4(g.position, g.path));
    imageStore(uimages_rg32ui[VIEW.image_surface], pixel, uvec4(pack_normal(g.face_normal), pack_normal(g.normal), 0, 0));
    imageStore(images_rgba16f[VIEW.image_albedo], pixel, vec4(min(g.albedo, vec3(60000.0)), 0.0));
}

GBufferPixel gbuffer_read(ivec2 pixel) {
    GBufferPixel g;
    vec4 position = imageLoad(images_rgba32f[VIEW.image_position], pixel);
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.image_surface], pixel).xy;
    g.position = position.xyz;
    g.path = position.w;
    g.face_normal = unpack_normal(surface.x);
    g.normal = unpack_normal(surface.y);
    g.albedo = imageLoad(images_rgba16f[VIEW.image_albedo], pixel).rgb;
    return g;
}

#endif
