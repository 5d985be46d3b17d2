#version 460
// Computes the exposure from the histogram. The map's base exposure (stops at which it looks as bright as in the
// engine) dominates; automatic exposure corrects a part of this view's difference from a usual picture of the map. It
// measures the mean logarithm of luminance between two percentiles (Reinhard et al., Photographic Tone Reproduction for
// Digital Images, SIGGRAPH 2002, equation 1) and moves it towards that of the usual picture (equation 2: the key over
// that mean). Dark rooms stay darker than bright ones, because the map's author chose their light: the key falls with
// the picture's luminance (as in Krawczyk et al. 2005, section 3.1; here by a constant part of the difference in
// stops). The exposure follows exponentially, faster from dark to bright than from bright to dark (their section 3.2).
// Only surfaces are measured, and the correction is scaled by the part of the picture that they cover.
#include "trace/exposure.glsl"
#include "trace/picture.glsl"

layout(local_size_x = EXPOSURE_BINS) in;

shared uint bins[EXPOSURE_BINS];

// Corrected part of the difference, and its bounds. Small, so that a picture stays within a quarter of the brightness
// of the classic look, which has no automatic exposure.
const float ADAPTATION = 0.15;
const float MIN_STOPS = -0.75, MAX_STOPS = 0.75;

void main() {
    ExposureState state = ExposureState(VIEW.exposure.state);
    uint own = gl_LocalInvocationIndex;
    bins[own] = state.bins[own];
    state.bins[own] = 0;
    barrier();
    if (own != 0) return;
    float whole = float(histogram_size().x) * float(histogram_size().y), total = 0.0;
    for (uint i = 0; i < EXPOSURE_BINS; i++) total += float(bins[i]);
    float from = total * EXPOSURE_DARK_PART, to = total * (1.0 - EXPOSURE_BRIGHT_PART);
    float below = 0.0, sum = 0.0, weight = 0.0;
    for (uint i = 0; i < EXPOSURE_BINS; i++) {
        float count = float(bins[i]);
        float inside = max(min(below + count, to) - max(below, from), 0.0);
        float middle = EXPOSURE_MIN_LOG + (float(i) + 0.5) / float(EXPOSURE_BINS) * (EXPOSURE_MAX_LOG - EXPOSURE_MIN_LOG);
        sum += inside * middle;
        weight += inside;
        below += count;
    }
    float stops = 0.0;
    if ((VIEW.flags & VIEW_AUTO_EXPOSURE) != 0 && weight > 0.0)
        stops = clamp((VIEW.exposure.usual - VIEW.exposure.base - sum / weight) * ADAPTATION, MIN_STOPS, MAX_STOPS) * (total / whole);
    float old = log2(clamp(state.exposure, exp2(MIN_STOPS), exp2(MAX_STOPS)));
    if ((VIEW.flags & VIEW_EXPOSURE_RESET) != 0 || isnan(old)) old = stops;
    state.exposure = exp2(mix(old, stops, stops < old ? VIEW.exposure.blend : VIEW.exposure.blend_dark));
}
