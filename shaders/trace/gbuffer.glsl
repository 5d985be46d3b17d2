// The G-buffer: position (8 bytes a pixel), view distance (4, see `view_distance.glsl`), normals (8), albedo and front
// (8), motion (8, see `motion.glsl`). `albedo` includes everything between the camera and the surface: the light L of
// the point shows as albedo * L + front. Both are packed as light is, in 4 bytes each.
#ifndef RELIGHT_TRACE_GBUFFER_GLSL
#define RELIGHT_TRACE_GBUFFER_GLSL

#include "trace/direction.glsl"
#include "trace/light_image.glsl"
#include "trace/view_distance.glsl"

struct GBufferPixel {
    vec3 position;
    float view_distance; // length of the path from the camera; negative: no lit surface
    vec3 face_normal;
    vec3 normal;
    vec3 albedo;
    vec3 front; // radiance of the layers in front of the surface, and of its own emission
    bool first_person; // the surface belongs to the first-person view: its rays skip third-person geometry
};

// Where a pixel shows a point at this view distance, if nothing bends the ray through its middle.
vec3 place_ahead(ivec2 pixel, float view_distance) {
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(VIEW.width, VIEW.height) * 2.0 - 1.0;
    ndc.x += VIEW.camera.stereo_shift;
    return VIEW.camera.origin + normalize(VIEW.camera.forward - VIEW.camera.left * ndc.x - VIEW.camera.up * ndc.y) * view_distance;
}

// Positions are stored relative to `place_ahead`: three integers of 20 bits with one exponent of 4. The error of what is
// seen directly is less than that of a float; behind mirrors and portals it is a millionth of the distance between the
// surface and its image.
const int STEP_BITS = 19, LEAST_EXPONENT = 3;
const float MOST_AWAY = 262143.0;

uvec2 pack_away(vec3 away) {
    away = clamp(away, -MOST_AWAY, MOST_AWAY);
    float largest = max(abs(away.x), max(abs(away.y), abs(away.z)));
    int exponent = max(int(floatBitsToUint(largest) >> 23) - 126, LEAST_EXPONENT); // largest < 2^exponent
    float scale = uintBitsToFloat(uint(STEP_BITS - exponent + 127) << 23);
    const int HALF = 1 << STEP_BITS;
    uvec3 steps = uvec3(clamp(ivec3(round(away * scale)), -HALF, HALF - 1) + HALF);
    return uvec2(steps.x | steps.y << 20, steps.y >> 12 | steps.z << 8 | uint(exponent - LEAST_EXPONENT) << 28);
}

vec3 unpack_away(uvec2 packed) {
    float scale = uintBitsToFloat(((packed.y >> 28) + uint(LEAST_EXPONENT - STEP_BITS + 127)) << 23);
    ivec3 steps = ivec3(packed.x & 0xFFFFFu, packed.x >> 20 | (packed.y & 0xFFu) << 12, packed.y >> 8 & 0xFFFFFu);
    return vec3(steps - (1 << STEP_BITS)) * scale;
}

// Position of the lit surface, and its view distance; view distance -1: none. `tail`: `distance_tail_read`.
vec4 place_read(ivec2 pixel, uint tail) {
    float view_distance = lit_distance_read(pixel, tail);
    if (view_distance < 0.0) return vec4(0.0, 0.0, 0.0, -1.0);
    return vec4(place_ahead(pixel, view_distance) + unpack_away(imageLoad(uimages_rg32ui[VIEW.images.position], pixel).xy), view_distance);
}
vec4 place_read(ivec2 pixel) { return place_read(pixel, distance_tail_read(pixel)); }

// Writes albedo and front. `dither`: see `pack_light`.
void shown_write(uint image, ivec2 pixel, GBufferPixel g, vec2 dither) {
    imageStore(uimages_rg32ui[image], pixel, uvec4(pack_light(g.albedo, dither.x), pack_light(g.front, dither.y), 0, 0));
}

void shown_read(uint image, ivec2 pixel, inout GBufferPixel g) {
    uvec2 shown = imageLoad(uimages_rg32ui[image], pixel).xy;
    g.albedo = unpack_light(shown.x);
    g.front = unpack_light(shown.y);
}

// Writes all but view distance and motion. `dither`: see `pack_light`.
void gbuffer_write(ivec2 pixel, GBufferPixel g, vec2 dither) {
    if (g.view_distance >= 0.0)
        imageStore(uimages_rg32ui[VIEW.images.position], pixel, uvec4(pack_away(g.position - place_ahead(pixel, stored_distance(g.view_distance))), 0, 0));
    imageStore(uimages_rg32ui[VIEW.images.surface], pixel, uvec4(pack_normal(g.face_normal), pack_normal(g.normal), 0, 0));
    shown_write(VIEW.images.shown, pixel, g, dither);
}

GBufferPixel gbuffer_read(ivec2 pixel) {
    GBufferPixel g;
    uint tail = distance_tail_read(pixel);
    vec4 place = place_read(pixel, tail);
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).xy;
    g.position = place.xyz;
    g.view_distance = place.w;
    g.first_person = (tail & TAIL_FIRST_PERSON) != 0;
    g.face_normal = unpack_normal(surface.x);
    g.normal = unpack_normal(surface.y);
    shown_read(VIEW.images.shown, pixel, g);
    return g;
}

#endif
