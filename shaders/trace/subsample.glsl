// Subsampled bounced light: one of each 2 x 2 pixels gathers it, each pixel once in four frames. If another pixel of
// the cell shades a gradient sample, it gathers instead, so that the sample can be compared.
#ifndef RELIGHT_TRACE_SUBSAMPLE_GLSL
#define RELIGHT_TRACE_SUBSAMPLE_GLSL

#include "trace/gradient_reproject.glsl"

// Edge of a cell, pixels.
const int CELL = 2;

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
    return (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) == 0 || subsample_pixel(pixel / CELL) == pixel;
}

#endif
