// The filter of specular light in live frames (`rt_denoiser`). One of 2 x 2 pixels traces a path. `specular_temporal.comp`
// joins the paths around a pixel with the light of earlier frames; `specular_filter.comp` smooths it by the lobe's size.
#ifndef RELIGHT_TRACE_SPECULAR_FILTER_GLSL
#define RELIGHT_TRACE_SPECULAR_FILTER_GLSL

#include "trace/denoise.glsl"
#include "trace/motion.glsl"
#include "trace/subsample.glsl"
#include "trace/specular_surface.glsl"

// Most frames in the mean.
const float SPECULAR_FRAMES = 24.0;

// Largest number of frames that a texel holds, in steps of an eighth.
const float FRAME_CODES = 255.0 / 8.0;

// Light of a pixel, before the reflectance, for the next frame.
struct SpecularTexel {
    vec3 light;
    float frames;    // 0: no rough surface
    float roughness; // perceptual
    float hit_distance; // from the surface to what it reflects
};

void specular_texel_write(uint image, ivec2 pixel, SpecularTexel t, float dither) {
    uint codes = packUnorm4x8(vec4(t.frames / FRAME_CODES, t.roughness, 0.0, 0.0)) & 0xFFFFu;
    imageStore(uimages_rg32ui[image], pixel, uvec4(pack_light(finite_light(t.light), dither), codes | packHalf2x16(vec2(0.0, t.hit_distance)), 0, 0));
}

SpecularTexel specular_texel_read(uint image, ivec2 pixel) {
    uvec2 texel = imageLoad(uimages_rg32ui[image], pixel).xy;
    vec2 codes = unpackUnorm4x8(texel.y).xy;
    return SpecularTexel(unpack_light(texel.x), codes.x * FRAME_CODES, codes.y, unpackHalf2x16(texel.y).y);
}

float roughness_of(Gloss gloss) { return sqrt(gloss.alpha); }

// Similarity of two pixels for the filter: both on one plane, of about the same roughness and normal. A sharper lobe
// needs more equal normals.
float likeness(vec4 place, vec3 normal, float roughness, vec4 other, vec3 other_normal, float other_roughness, float tolerance) {
    if (other.w < 0.0 || abs(dot(other.xyz - place.xyz, normal)) > tolerance || abs(other_roughness - roughness) > 0.1) return 0.0;
    float apart = 1.0 - dot(normal, other_normal);
    return exp(-apart / max(0.5 * roughness * roughness, 2.0e-4));
}

// Radius of a lobe on the screen, pixels: the tangent of its half width times the part of the way to the camera that
// spreads it (Deferred Hybrid Path Tracing, section 26.5.3).
float lobe_radius(float roughness, float hit_distance, float view_distance) {
    float alpha = roughness * roughness;
    return 0.5 * alpha * hit_distance / max((hit_distance + view_distance) * VIEW.camera.pixel_spread, 1.0e-6);
}

// Unit vector along the ray of a pixel of the last frame.
vec3 last_direction(vec2 pixel) {
    vec2 ndc = pixel / vec2(VIEW.width, VIEW.height) * 2.0 - 1.0;
    ndc.x += VIEW.camera.stereo_shift;
    return normalize(VIEW.last_camera.forward - VIEW.last_camera.left * ndc.x - VIEW.last_camera.up * ndc.y);
}

// Where the last frame's camera saw a point, pixels from the left and top; x negative: nowhere.
vec2 last_seen(vec3 point) {
    vec3 v = point - VIEW.last_camera.origin;
    float depth = dot(v, VIEW.last_camera.forward);
    if (depth <= 0.0) return vec2(-1.0e6);
    vec2 ndc = -vec2(dot(v, VIEW.last_camera.left) / dot(VIEW.last_camera.left, VIEW.last_camera.left),
        dot(v, VIEW.last_camera.up) / dot(VIEW.last_camera.up, VIEW.last_camera.up)) / depth;
    ndc.x -= VIEW.camera.stereo_shift;
    return (ndc * 0.5 + 0.5) * vec2(VIEW.width, VIEW.height);
}

// Whether a surface of this motion is where it was in the last frame.
bool rests_in_last(Motion motion, vec3 position) {
    if (motion.last_view_distance < 0.0) return false;
    return abs(distance(position, VIEW.last_camera.origin) - motion.last_view_distance) < 0.02 + 2.0e-3 * motion.last_view_distance;
}

#endif
