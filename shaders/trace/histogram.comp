#version 460
// Histogram of log luminance over one of each 2 x 2 pixels that show a lit surface. The usual picture of the map, the
// reference of the exposure, consists of such surfaces; the brightness of a sky or of black space is unrelated to
// theirs.
#include "trace/exposure.glsl"
#include "trace/picture.glsl"
#include "trace/view_distance.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

bool shows_surface(ivec2 pixel) {
    vec2 traced = (vec2(pixel) + 0.5) * vec2(VIEW.width, VIEW.height) / vec2(picture_size());
    return is_lit_read(ivec2(traced));
}

shared uint counts[EXPOSURE_BINS];

void main() {
    uint local_index = gl_LocalInvocationIndex;
    if (local_index < EXPOSURE_BINS) counts[local_index] = 0;
    barrier();
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (all(lessThan(cell, histogram_size()))) {
        // alternates over the four pixels, so that no row or column of a pattern is skipped
        ivec2 pixel = min(cell * 2 + (cell.yx & 1), picture_size() - 1);
        if (shows_surface(pixel)) {
            float value = log2(max(luminance(picture_load(pixel)), 1.0e-6));
            float place = (value - EXPOSURE_MIN_LOG) / (EXPOSURE_MAX_LOG - EXPOSURE_MIN_LOG);
            atomicAdd(counts[uint(clamp(place, 0.0, 0.9999) * float(EXPOSURE_BINS))], 1u);
        }
    }
    barrier();
    if (local_index < EXPOSURE_BINS && counts[local_index] > 0)
        atomicAdd(ExposureState(VIEW.exposure.state).bins[local_index], counts[local_index]);
}
