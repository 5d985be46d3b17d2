// The G-buffer: position and view distance (16 bytes a pixel), normals (8), albedo and front (8), motion (8) and view
// distance once more (2, see `motion.glsl`). `albedo` includes everything between the camera and the surface: the light
// L of the point shows as albedo * L + front. Both are packed as light is, in 4 bytes each.
#ifndef RELIGHT_TRACE_GBUFFER_GLSL
#define RELIGHT_TRACE_GBUFFER_GLSL

#include "trace/direction.glsl"
#include "trace/light_image.glsl"
#include "trace/view.glsl"

struct GBufferPixel {
    vec3 position;
    float view_distance; // length of the path from the camera; negative: no lit surface
    vec3 face_normal;
    vec3 normal;
    vec3 albedo;
    vec3 front; // radiance of the layers in front of the surface, and of its own emission
    bool first_person; // the surface belongs to the first-person view: its rays skip third-person geometry
};

// The lowest bit of the view distance, a ten-millionth of its value, holds `first_person`.
float pack_view_distance(GBufferPixel g) { return uintBitsToFloat(floatBitsToUint(g.view_distance) & ~1u | (g.first_person ? 1u : 0u)); }
bool first_person_of(float packed) { return (floatBitsToUint(packed) & 1u) != 0; }

// Writes albedo and front. `dither`: see `pack_light`.
void shown_write(uint image, ivec2 pixel, GBufferPixel g, vec2 dither) {
    imageStore(uimages_rg32ui[image], pixel, uvec4(pack_light(g.albedo, dither.x), pack_light(g.front, dither.y), 0, 0));
}

void shown_read(uint image, ivec2 pixel, inout GBufferPixel g) {
    uvec2 shown = imageLoad(uimages_rg32ui[image], pixel).xy;
    g.albedo = unpack_light(shown.x);
    g.front = unpack_light(shown.y);
}

// `dither`: see `pack_light`.
void gbuffer_write(ivec2 pixel, GBufferPixel g, vec2 dither) {
    imageStore(images_rgba32f[VIEW.images.position], pixel, vec4(g.position, pack_view_distance(g)));
    imageStore(uimages_rg32ui[VIEW.images.surface], pixel, uvec4(pack_normal(g.face_normal), pack_normal(g.normal), 0, 0));
    shown_write(VIEW.images.shown, pixel, g, dither);
}

GBufferPixel gbuffer_read(ivec2 pixel) {
    GBufferPixel g;
    vec4 position = imageLoad(images_rgba32f[VIEW.images.position], pixel);
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).xy;
    g.position = position.xyz;
    g.view_distance = position.w;
    g.first_person = first_person_of(position.w);
    g.face_normal = unpack_normal(surface.x);
    g.normal = unpack_normal(surface.y);
    shown_read(VIEW.images.shown, pixel, g);
    return g;
}

#endif
