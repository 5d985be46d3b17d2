// Hits of bounce rays in the picture of the last frame (Willberger, Musterle, Bergmann, Deferred Hybrid Path Tracing, Ray
// Tracing Gems, 2019, sections 26.2 and 26.3.2). `screen_march.comp` finds them by the depth that `screen_light.comp` has
// kept of the last frame, with the light that each surface sends in all directions.
#ifndef RELIGHT_TRACE_SCREEN_GLSL
#define RELIGHT_TRACE_SCREEN_GLSL

#include "trace/bounce_ray.glsl"

// 1: the first ray of a path looks for a hit in the last frame's picture. 0 removes the code.
layout(constant_id = 7) const uint SCREEN_HITS = 0;

// In place of the index of a geometry: the ray hits a pixel of the last frame, whose place is the primitive.
const uint SCREEN_HIT = NO_HIT - 1u;

// In place of an albedo in `VIEW.screen.surface`: the first surface of the pixel's ray sends no light that a bounce may
// take; its distance follows. No light is packed to this code.
const uint SCREEN_NO_LIGHT = 0xFFFFFFFFu;

// A pixel of the last frame: distance from the camera to the first surface, negative where a bounce may not take its
// light; least distance of the pixels around.
vec2 screen_depth_read(ivec2 pixel) { return unpackHalf2x16(imageLoad(uimages_r32ui[VIEW.screen.depth], pixel).x); }

// Point at a distance from the last frame's camera on the ray through the middle of a pixel.
vec3 screen_point(ivec2 pixel, float distance) {
    vec2 ndc = (vec2(pixel) + 0.5) / vec2(VIEW.width, VIEW.height) * 2.0 - 1.0;
    ndc.x += VIEW.camera.stereo_shift;
    return VIEW.last_camera.origin + normalize(VIEW.last_camera.forward - VIEW.last_camera.left * ndc.x - VIEW.last_camera.up * ndc.y) * distance;
}

// Result of the march, in place of the hit: the pixel that the ray hits, or where the ray starts for the tracer.
void screen_march_write(ivec2 cell, Hit hit) {
    BounceTexels(VIEW.scratch).at[bounce_place(cell, 0)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.t), 0);
}

Hit screen_march_read(ivec2 cell) {
    uvec4 texel = BounceTexels(VIEW.scratch).at[bounce_place(cell, 0)];
    return Hit(texel.x, texel.y, vec2(0.0), uintBitsToFloat(texel.z));
}

// Adds the light of a hit in the last frame's picture.
void screen_shade(Hit hit, vec3 origin, vec3 throughput, inout vec3 sum) {
    ivec2 pixel = unpack_place(hit.primitive);
    if (HAS_FOG != 0) {
        vec3 way = screen_point(pixel, abs(screen_depth_read(pixel).x)) - origin, fog = vec3(0.0);
        float t = max(length(way), 1.0e-3);
        fog_in_light(origin, way / t, t, throughput, fog);
        sum += fog * exp2(-VIEW.exposure.base);
    }
    sum += throughput * light_read(VIEW.screen.light, pixel);
}

#endif
