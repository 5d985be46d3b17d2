// Every other pixel, as on a chess board: the colours change places each frame. Where the other pixel of a cell is a
// gradient sample, it takes the turn of the first: it has to be traced to be compared.
#ifndef RELIGHT_TRACE_SPARSE_GLSL
#define RELIGHT_TRACE_SPARSE_GLSL

#include "trace/carry.glsl"

// Whose turn it is in a cell of two pixels side by side.
ivec2 turn_of(ivec2 cell) { return ivec2(cell.x * 2 + ((cell.y + int(VIEW.seed)) & 1), cell.y); }

ivec2 other_of(ivec2 cell, ivec2 pixel) { return ivec2(cell.x * 4 + 1 - pixel.x, cell.y); }

// The pixel that is traced.
ivec2 sparse_pixel(ivec2 cell) {
    ivec2 pixel = turn_of(cell), other = other_of(cell, pixel);
    return !is_carried(pixel) && inside(other) && is_carried(other) ? other : pixel;
}

// The other pixel of the cell.
ivec2 skipped_pixel(ivec2 cell) { return other_of(cell, sparse_pixel(cell)); }

// Whether bounced light was gathered for the pixel itself.
bool is_gathered(ivec2 pixel) {
    return (VIEW.flags & VIEW_SPARSE_BOUNCE) == 0 || sparse_pixel(ivec2(pixel.x / 2, pixel.y)) == pixel;
}

#endif
