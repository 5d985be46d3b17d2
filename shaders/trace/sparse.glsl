// Bounced light is gathered for one of each 2 x 2 pixels, and in four frames for all. Where another pixel of a cell is a
// gradient sample, it takes the turn: it has to be traced to be compared.
#ifndef RELIGHT_TRACE_SPARSE_GLSL
#define RELIGHT_TRACE_SPARSE_GLSL

#include "trace/carry.glsl"

// Pixels to the edge of a cell.
const int CELL = 2;

// Where in a cell the pixel is whose turn it is.
ivec2 turn() {
    uint frame = VIEW.seed & 3u;
    // across, then the other two, so that two frames make a chessboard
    return ivec2(frame == 1u || frame == 2u, frame == 1u || frame == 3u);
}

// The pixel of a cell that is traced.
ivec2 sparse_pixel(ivec2 cell) {
    ivec2 end = ivec2(VIEW.width, VIEW.height) - 1, pixel = min(cell * CELL + turn(), end);
    if ((DENOISE.flags & DENOISE_GRADIENTS) == 0) return pixel;
    for (int i = 0; i < 4; i++) {
        ivec2 other = min(cell * CELL + (turn() ^ ivec2(i & 1, i >> 1)), end);
        if (is_carried(other)) return other;
    }
    return pixel;
}

// Whether bounced light was gathered for the pixel itself.
bool is_gathered(ivec2 pixel) {
    return (VIEW.flags & VIEW_SPARSE_BOUNCE) == 0 || sparse_pixel(pixel / CELL) == pixel;
}

#endif
