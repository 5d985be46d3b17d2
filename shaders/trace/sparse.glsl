// Every other pixel, as on a chess board: the colours change places each frame.
#ifndef RELIGHT_TRACE_SPARSE_GLSL
#define RELIGHT_TRACE_SPARSE_GLSL

// The pixel that is traced in a cell of two side by side.
ivec2 sparse_pixel(ivec2 cell) { return ivec2(cell.x * 2 + ((cell.y + int(VIEW.seed)) & 1), cell.y); }

// The other pixel of the cell.
ivec2 skipped_pixel(ivec2 cell) { return ivec2(cell.x * 2 + ((cell.y + int(VIEW.seed) + 1) & 1), cell.y); }

#endif
