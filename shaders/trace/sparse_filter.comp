#version 460
// Second pass of the sparse filter: a joint bilateral filter of sixteen taps scattered over a disc, from shared memory.
// The pattern is rotated from pixel to pixel and frame to frame (Willberger, Musterle, Bergmann, Deferred Hybrid Path
// Tracing, Ray Tracing Gems, 2019, chapter 26: few scattered taps in place of a dense kernel). The inner taps alone
// make the history of the next frame, so that a history of many frames is blurred little. It keeps no variance: the
// number of accumulated frames estimates the noise.
#include "trace/sparse_filter.glsl"

const int GROUP = 16, RADIUS = 7, ACROSS = GROUP + 2 * RADIUS;
layout(local_size_x = GROUP, local_size_y = GROUP) in;

const int TAPS = 16, INNER_TAPS = 5;
const float LOG2_E = 1.44269504;

// Light, normal and signed inverse depth of the work group's texels and those around, as 16-bit floats: inverse depth
// is negative for reflections that alternate with refraction, 0 without a surface. 14,400 of the 16,384 bytes that
// every device has.
shared uvec4 texels[ACROSS * ACROSS];

struct Tap {
    vec3 light;
    float value;
    vec3 normal;
    float inverse;
};

uvec4 shared_texel(uvec2 packed) {
    if (packed.y == 0) return uvec4(0);
    // within the range of 16-bit floats
    vec3 light = min(unpack_light(packed.x), vec3(60000.0)), normal = sparse_normal(packed.y);
    float inverse = unpackHalf2x16(packed.y & 0x7FFFu).x;
    if ((packed.y & REFLECTION_BIT) != 0) inverse = -inverse;
    return uvec4(packHalf2x16(light.rg), packHalf2x16(vec2(light.b, luminance(light))), packHalf2x16(normal.xy), packHalf2x16(vec2(normal.z, inverse)));
}

Tap shared_tap(int place) {
    uvec4 t = texels[place];
    vec2 rest = unpackHalf2x16(t.y), last = unpackHalf2x16(t.w);
    return Tap(vec3(unpackHalf2x16(t.x), rest.x), rest.y, vec3(unpackHalf2x16(t.z), last.x), last.y);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), corner = ivec2(gl_WorkGroupID.xy) * GROUP - RADIUS;
    for (int i = int(gl_LocalInvocationIndex); i < ACROSS * ACROSS; i += GROUP * GROUP) {
        ivec2 from = corner + ivec2(i % ACROSS, i / ACROSS);
        texels[i] = inside(from) ? shared_texel(SparseTexels(DENOISE.fresh).at[place_of(from)]) : uvec4(0);
    }
    barrier();
    if (!inside(pixel)) return;
    uvec2 own = SparseTexels(DENOISE.fresh).at[place_of(pixel)];
    if (own.y == 0) {
        SparseTexels(DENOISE.history).at[place_of(pixel)] = uvec2(0);
        return;
    }
    int place = (int(gl_LocalInvocationID.y) + RADIUS) * ACROSS + int(gl_LocalInvocationID.x) + RADIUS;
    Tap middle = shared_tap(place);
    vec2 depth_gradient = imageLoad(images_rg16f[DENOISE.depth_gradient], pixel).xy;
    // the noise of one frame is about as large as the light
    float light_scale = LOG2_E * 1.5 * sqrt(max(sparse_frames(own.y), 1.0));
    float plane_scale = LOG2_E / (0.01 + 2.0 * VIEW.camera.pixel_spread * float(RADIUS));

    float turn = 2.0 * PI * dither(pixel, DITHER_ROTATION);
    mat2 rotation = float(RADIUS) * mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
    vec3 sum = middle.light, inner_sum = vec3(0.0);
    float total = 1.0, inner_total = 1.0;
    for (int i = 0; i < TAPS; i++) {
        // radii that cover a disc evenly, angles that are far apart (Vogel's spiral)
        float angle = float(i) * 2.39996323, radius = sqrt((float(i) + 0.5) / float(TAPS));
        vec2 offset = round(rotation * (radius * vec2(cos(angle), sin(angle))));
        Tap other = shared_tap(place + int(offset.y) * ACROSS + int(offset.x));
        // 1 on the plane of the middle; far from it without a surface, and in the other field
        float off_plane = abs(other.inverse / middle.inverse - 1.0 - dot(depth_gradient, offset));
        float alike = max(dot(middle.normal, other.normal), 0.0);
        alike *= alike; alike *= alike; alike *= alike;
        // the larger of both values sets the scale, so that bright outliers are filtered too
        float away = abs(other.value - middle.value) * light_scale / max(max(middle.value, other.value), 1.0e-6);
        float weight = alike * exp2(-off_plane * plane_scale - away);
        sum += other.light * weight;
        total += weight;
        if (i == INNER_TAPS - 1) {
            inner_sum = sum;
            inner_total = total;
        }
    }
    SparseTexel kept = SparseTexel(inner_sum / inner_total, own.y);
    sparse_write(DENOISE.history, pixel, kept, dither(pixel, DITHER_PAST));
    light_write(VIEW.images.direct, pixel, sum / total, dither(pixel, DITHER_FILTERED));
}
