// Subsampled bounced light: one of each 2 x 2 pixels gathers it, each pixel once in four frames. If another pixel of
// the cell shades a gradient sample, it gathers instead, so that the sample can be compared.
#ifndef RELIGHT_TRACE_SUBSAMPLE_GLSL
#define RELIGHT_TRACE_SUBSAMPLE_GLSL

#include "trace/gradient_reproject.glsl"
#include "trace/motion.glsl"

// Edge of a cell, pixels.
const int CELL = 2;

// 1: only the cells gather that `bounce_select.comp` has marked. 0 removes the code.
layout(constant_id = 8) const uint ADAPTIVE = 0;

// 1: the other eye's light of this frame is known (`rt_shareEyes`). 0 removes the code.
layout(constant_id = 19) const uint SHARED_EYES = 0;

// Where the other eye shows the point that this one shows at `pixel`: the cameras differ by an offset to the side and an
// opposite slope of the picture, so that depths are equal. Also for a flat mirror's image, which stands still.
vec2 other_eye_pixel(ivec2 pixel, float depth) {
    float shift = VIEW.camera.stereo_shift * (1.0 - DENOISE.convergence / max(depth, NEAREST_DEPTH));
    return vec2(pixel) + vec2(float(VIEW.width) * shift, 0.0);
}

// Whether the cell gathers bounced light.
bool is_selected(ivec2 cell) { return ADAPTIVE == 0 || imageLoad(uimages_r32ui[DENOISE.selected], cell).x != 0; }

// In the image of bounced light: no pixel around has gathered. No light is packed to this code.
const uint NOT_GATHERED = 0xFFFFFFFFu;

// Area of the surface that the pixel covers, over that which it covered in the last frame, at most 1: where the camera
// comes closer, samples of the history belong to several pixels. Of a surface that has moved only the distance counts.
float distortion(ivec2 pixel) {
    Motion motion = motion_read(pixel);
    vec4 place = place_read(pixel);
    if (!(place.w > 0.0) || !(motion.last_view_distance > 0.0)) return 1.0;
    vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).x);
    vec3 before = normalize(VIEW.last_camera.origin - place.xyz), now = normalize(VIEW.camera.origin - place.xyz);
    float cosines = max(abs(dot(normal, before)), 0.01) / max(abs(dot(normal, now)), 0.01);
    float distances = place.w / motion.last_view_distance;
    // half floats round distances by a two-thousandth
    return min(distances * distances * cosines + 1.0e-3, 1.0);
}

// Position in its cell of the pixel that gathers, for a row of cells.
ivec2 gathered_offset(int row) {
    uint frame = VIEW.seed & 3u;
    // diagonal pixels first, then the other two, so that two frames form a checkerboard; shifted in every other row, so
    // that each frame has pixels of both fields where reflection and refraction alternate
    return ivec2((frame == 1u || frame == 2u) != ((row & 1) == 1), frame == 1u || frame == 3u);
}

// Index of this frame among those in which the pixel gathers. Numbers that are evenly spread over all frames are not
// evenly spread over every fourth.
uint subsample_index(uint frame) { return (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) != 0 ? frame >> 2 : frame; }

// The pixel of a cell that gathers.
ivec2 subsample_pixel(ivec2 cell) {
    ivec2 end = ivec2(VIEW.width, VIEW.height) - 1, first = gathered_offset(cell.y), pixel = min(cell * CELL + first, end);
    if ((DENOISE.flags & DENOISE_GRADIENTS) == 0) return pixel;
    for (int i = 0; i < 4; i++) {
        ivec2 other = min(cell * CELL + (first ^ ivec2(i & 1, i >> 1)), end);
        if (is_gradient_pixel(other)) return other;
    }
    return pixel;
}

// Whether the pixel itself has gathered bounced light.
bool is_gathered(ivec2 pixel) {
    return (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) == 0 || is_selected(pixel / CELL) && subsample_pixel(pixel / CELL) == pixel;
}

#endif
