// Gradient samples of A-SVGF (Schied, Peters, Dachsbacher, Gradient Estimation for Real-Time Adaptive Temporal
// Filtering, 2018, section 4.2). Each frame stores one shaded pixel of each stratum of 3 x 3. The next frame finds the
// current position of that surface and shades it there again with the same random numbers, in place of the pixel's own
// surface with new numbers. The difference is then a change of the light, not noise.
#ifndef RELIGHT_TRACE_GRADIENT_REPROJECT_GLSL
#define RELIGHT_TRACE_GRADIENT_REPROJECT_GLSL

#include "trace/denoise.glsl"

// A texel of the image `gradient_pixels`: the pixel of the stratum that shades a sample, the sample's position in the
// last frame, and whether its surface has moved. 32 bits: 14 and 13 for the position, 5 for the rest. All ones: none.
const uint NO_GRADIENT_PIXEL = 0xFFFFFFFFu;
const ivec2 GRADIENT_PIXEL_LIMIT = ivec2(1 << 14, 1 << 13);

struct GradientPixel {
    bool valid;
    bool moved;
    int index;   // of the pixel in the stratum
    ivec2 last;  // pixel of the last frame
};

uint pack_place(ivec2 pixel) { return uint(pixel.x) | uint(pixel.y) << 14; }
ivec2 unpack_place(uint packed) { return ivec2(packed & 0x3FFFu, packed >> 14 & 0x1FFFu); }

uint pack_gradient_pixel(int index, bool moved, ivec2 last) { return pack_place(last) | uint(index + (moved ? 9 : 0)) << 27; }

GradientPixel gradient_pixel_at(ivec2 stratum) {
    uint record = imageLoad(uimages_r32ui[DENOISE.gradient_pixels], stratum).x;
    int index = int(record >> 27);
    return GradientPixel(index < 18, index >= 9, index % 9, unpack_place(record));
}

ivec2 pixel_of(ivec2 stratum, int index) { return stratum * STRATUM + ivec2(index % STRATUM, index / STRATUM); }

// Whether the pixel shades a sample of the last frame.
bool is_gradient_pixel(ivec2 pixel) {
    if ((DENOISE.flags & DENOISE_GRADIENTS) == 0) return false;
    ivec2 stratum = pixel / STRATUM;
    GradientPixel c = gradient_pixel_at(stratum);
    return c.valid && pixel_of(stratum, c.index) == pixel;
}

// The stored sample of a stratum.
struct LitSample {
    bool valid;
    ivec2 pixel;
    vec3 position;
    float view_distance;
    vec3 face_normal;
    vec3 normal;
    vec2 light; // luminance of direct and indirect light, rounded to 16-bit floats; negative: unknown
};

void keep_nothing(ivec2 stratum) { imageStore(uimages_rgba32ui[DENOISE.samples], stratum, uvec4(NO_GRADIENT_PIXEL)); }

// The lowest bit of the view distance, a ten-millionth of its value, holds whether the surface is of the first-person
// view.
bool first_person_of(float packed) { return (floatBitsToUint(packed) & 1u) != 0; }

void keep_sample(ivec2 stratum, ivec2 pixel, uvec2 normals, vec2 light) {
    uint tail = distance_tail_read(pixel);
    vec4 place = place_read(pixel, tail);
    uint view_distance = floatBitsToUint(place.w) & ~1u | ((tail & TAIL_FIRST_PERSON) != 0 ? 1u : 0u);
    imageStore(uimages_rgba32ui[DENOISE.samples], stratum, uvec4(floatBitsToUint(place.xyz), pack_place(pixel)));
    imageStore(uimages_rgba32ui[DENOISE.sample_surfaces], stratum, uvec4(normals, packHalf2x16(light), view_distance));
}

LitSample kept_sample(ivec2 stratum) {
    uvec4 a = imageLoad(uimages_rgba32ui[DENOISE.samples], stratum), b = imageLoad(uimages_rgba32ui[DENOISE.sample_surfaces], stratum);
    return LitSample(a.w != NO_GRADIENT_PIXEL, unpack_place(a.w), uintBitsToFloat(a.xyz), uintBitsToFloat(b.w), unpack_normal(b.x),
        unpack_normal(b.y), unpackHalf2x16(b.z));
}

// The surface that a pixel shades, and its random numbers.
struct LightTask {
    GBufferPixel surface;
    ivec2 pixel;
    uint seed;
};

LightTask light_task(ivec2 pixel) {
    LightTask task = LightTask(gbuffer_read(pixel), pixel, VIEW.seed);
    if (!is_gradient_pixel(pixel)) return task;
    GradientPixel c = gradient_pixel_at(pixel / STRATUM);
    task.pixel = c.last;
    task.seed = DENOISE.last_seed;
    // a surface that has moved is shaded at its current position
    if (c.moved) return task;
    LitSample s = kept_sample(c.last / STRATUM);
    task.surface.position = s.position;
    task.surface.face_normal = s.face_normal;
    task.surface.normal = s.normal;
    task.surface.first_person = first_person_of(s.view_distance);
    return task;
}

#endif
