#version 460
// Constants and curves, from 0 to 4, for the test that compares them with `relight::exposure` and `relight::overbright`.
#define FILTER_STEP
#include "trace/exposure.glsl"
#include "trace/tone_curve.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Results {
    float constants[3];
    vec3 curves[]; // tone curve, linear value of an encoded one, encoded value of a linear one
};

void main() {
    uint index = gl_GlobalInvocationID.x;
    Results results = Results(push.target);
    if (index == 0) results.constants = float[](EXPOSURE_MIN_LOG, EXPOSURE_DARK_PART, EXPOSURE_BRIGHT_PART);
    if (index >= push.spacing) return;
    vec3 x = vec3(float(index) / 64.0);
    results.curves[index] = vec3(tone_curve(x).x, decode_display(x).x, encode_display(x).x);
}
