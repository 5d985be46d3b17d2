// State of automatic exposure, in a buffer that persists between frames.
#ifndef RELIGHT_TRACE_EXPOSURE_GLSL
#define RELIGHT_TRACE_EXPOSURE_GLSL

#include "trace/view.glsl"
#include "trace/color.glsl"

// Range of the histogram: luminance in stops.
const float EXPOSURE_MIN_LOG = -12.0, EXPOSURE_MAX_LOG = 8.0;
// Pixels left out at the dark and at the bright end, of those that are counted.
const float EXPOSURE_DARK_PART = 0.2, EXPOSURE_BRIGHT_PART = 0.05;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer ExposureState {
    float exposure; // factor of radiance
    uint bins[EXPOSURE_BINS];
};

#endif
