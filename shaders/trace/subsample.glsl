// Bounced light is gathered for one of each 2 x 2 pixels, and in four frames for all. Where another pixel of a cell is a
// gradient sample, it takes the turn: it has to be traced to be compared.
#ifndef RELIGHT_TRACE_SUBSAMPLE_GLSL
#define RELIGHT_TRACE_SUBSAMPLE_GLSL

#include "trace/gradient_reproject.glsl"

// Pixels to the edge of a cell.
const int CELL = 2;

// Where in a cell of a row of cells the pixel is whose turn it is.
ivec2 gathered_offset(int row) {
    uint frame = VIEW.seed & 3u;
    // across, then the other two, so that two frames make a chessboard; shifted in every other row, so that each frame has
    // pixels of both fields where a reflection and what lies behind it take turns
    return ivec2((frame == 1u || frame == 2u) != ((row & 1) == 1), frame == 1u || frame == 3u);
}

// Which of the frames that gather light for a pixel this one is. Numbers that are evenly spread over all frames are not over
// every fourth.
uint subsample_index(uint frame) { return (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) != 0 ? frame >> 2 : frame; }

// The pixel of a cell that is traced.
ivec2 subsample_pixel(ivec2 cell) {
    ivec2 end = ivec2(VIEW.width, VIEW.height) - 1, first = gathered_offset(cell.y), pixel = min(cell * CELL + first, end);
    if ((DENOISE.flags & DENOISE_GRADIENTS) == 0) return pixel;
    for (int i = 0; i < 4; i++) {
        ivec2 other = min(cell * CELL + (first ^ ivec2(i & 1, i >> 1)), end);
        if (is_gradient_pixel(other)) return other;
    }
    return pixel;
}

// Whether bounced light was gathered for the pixel itself.
bool is_gathered(ivec2 pixel) {
    return (VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) == 0 || subsample_pixel(pixel / CELL) == pixel;
}

#endif
