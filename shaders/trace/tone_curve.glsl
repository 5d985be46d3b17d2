// The tone curve: Uchimura's (HDR theory and practice, CEDEC 2017) with maximum brightness P = 1, contrast a = 1, linear
// section from m = 0 on, of length l = KNEE, and no toe. It is the identity up to KNEE, so that textures keep their
// authors' colours, and above it a shoulder, P - (P - KNEE) exp(-a (x - KNEE) / (P - KNEE)), with a continuous slope.
// Radiance 1, the white of the classic look, displays as 0.85 of white; brighter values approach white.
// `relight::exposure::tone_curve` is the same on the CPU; a test compares them.
#ifndef RELIGHT_TRACE_TONE_CURVE_GLSL
#define RELIGHT_TRACE_TONE_CURVE_GLSL

const float KNEE = 0.6;

vec3 tone_curve(vec3 x) {
    vec3 shoulder = 1.0 - (1.0 - KNEE) * exp(-(x - KNEE) / (1.0 - KNEE));
    return mix(shoulder, x, lessThan(x, vec3(KNEE)));
}

// The same curve with a maximum of `peak`, for a display that shows more than white.
vec3 tone_curve_to(vec3 x, float peak) {
    vec3 shoulder = peak - (peak - KNEE) * exp(-(x - KNEE) / (peak - KNEE));
    return mix(shoulder, x, lessThan(x, vec3(KNEE)));
}

#endif
