#version 460
// A pass of the sparse filter: a joint bilateral filter of eight taps scattered over a disc. The pattern is rotated
// from pixel to pixel and frame to frame, so that neighbours use different taps and the next pass, with a smaller disc,
// averages their results (Willberger, Musterle, Bergmann, Deferred Hybrid Path Tracing, Ray Tracing Gems, 2019, chapter
// 26: few taps in several passes in place of a dense kernel). It keeps no variance: the number of accumulated frames
// estimates the noise.
#define FILTER_STEP
#include "trace/sparse_filter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: last pass; writes the image of direct light.
layout(constant_id = 0) const uint LAST = 0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    SparseTexel middle = sparse_read(push.source, pixel);
    if (middle.guide == 0) {
        if (LAST == 0) SparseTexels(push.target).at[place_of(pixel)] = uvec2(0);
        return;
    }
    float depth = sparse_depth(middle.guide), value = luminance(middle.light);
    vec3 normal = sparse_normal(middle.guide);
    vec2 depth_gradient = imageLoad(images_rg16f[DENOISE.depth_gradient], pixel).xy;
    float frames = max(sparse_frames(middle.guide), 1.0);
    // the noise of one frame is about as large as the light
    float light_scale = 1.5 * sqrt(frames);
    float plane_scale = 1.0 / (0.01 + 2.0 * VIEW.camera.pixel_spread * float(push.spacing));

    float rotation = 2.0 * PI * dither(pixel, DITHER_ROTATION + push.spacing);
    vec3 sum = middle.light;
    float total = 1.0;
    for (int i = 0; i < 8; i++) {
        // radii that cover a disc evenly, angles that are far apart (Vogel's spiral)
        float angle = rotation + float(i) * 2.39996323;
        vec2 offset = round(vec2(cos(angle), sin(angle)) * sqrt((float(i) + 0.5) / 8.0) * float(push.spacing));
        ivec2 tap = pixel + ivec2(offset);
        if (!inside(tap)) continue;
        SparseTexel other = sparse_read(push.source, tap);
        if (other.guide == 0 || ((other.guide ^ middle.guide) & REFLECTION_BIT) != 0) continue;
        float off_plane = abs((1.0 + dot(depth_gradient, offset)) * sparse_depth(other.guide) / depth - 1.0);
        float alike = max(dot(normal, sparse_normal(other.guide)), 0.0);
        alike *= alike; alike *= alike; alike *= alike;
        // the larger of both values sets the scale, so that bright outliers are filtered too
        float away = abs(luminance(other.light) - value) * light_scale / max(max(value, luminance(other.light)), 1.0e-6);
        float weight = alike * exp(-off_plane * plane_scale - away);
        sum += other.light * weight;
        total += weight;
    }
    middle.light = sum / total;
    if (LAST != 0) light_write(VIEW.images.direct, pixel, middle.light, dither(pixel, DITHER_FILTERED));
    else sparse_write(push.target, pixel, middle, dither(pixel, DITHER_FILTERED));
}
