#version 460
// From the histogram to the exposure. The map's own base (stops at which it looks as bright as the engine shows it) is
// what counts; automatic exposure corrects a part of how far this view is from a usual picture: the mean logarithm of
// luminance (Reinhard et al., Photographic Tone Reproduction for Digital Images, SIGGRAPH 2002, equation 1), taken
// between two percentiles, is brought towards that of a usual picture of the map (their equation 2: the key over that mean).
// Dark rooms stay darker than bright ones, for the map's author chose its light: the key falls with the picture's
// luminance (as in Krawczyk et al. 2005, section 3.1; here by a constant part of the difference in stops). The exposure
// follows exponentially, faster into the light than into the dark (their section 3.2). Surfaces alone are looked at, and as
// much of the correction is made as they cover of the picture.
#include "trace/exposure.glsl"
#include "trace/picture.glsl"

layout(local_size_x = EXPOSURE_BINS) in;

shared uint bins[EXPOSURE_BINS];

// How much of the difference is corrected, and bounds. Little: a picture is to stay within a quarter of the brightness
// that the classic look has, and that look adapts to nothing.
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
