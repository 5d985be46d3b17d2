// Display encoding of colours; the tracer's only implementation.
//
// Textures, vertex colours, entity colours and the colours of waves and constants are the values that the classic look
// would display: sRGB (IEC 61966-2-1). Stages are combined as displayed (`layer.glsl`) and decoded then; a decoded
// colour times white leaves the tone curve unchanged. Alpha is linear.
#ifndef RELIGHT_TRACE_COLOR_GLSL
#define RELIGHT_TRACE_COLOR_GLSL

vec3 decode_display(vec3 c) {
    vec3 low = c / 12.92;
    vec3 high = pow((max(c, 0.0) + 0.055) / 1.055, vec3(2.4));
    return mix(high, low, lessThanEqual(c, vec3(0.04045)));
}

vec3 encode_display(vec3 c) {
    vec3 low = c * 12.92;
    vec3 high = 1.055 * pow(max(c, 0.0), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, lessThanEqual(c, vec3(0.0031308)));
}

// Ratio of the linear to the displayed value; 1 from display white on, so that sums beyond white do not grow
// excessively. Terms of a displayed sum share its linear value in proportion to their displayed values.
vec3 display_slope(vec3 c) {
    vec3 bounded = clamp(c, 1.0e-4, 1.0);
    return decode_display(bounded) / bounded;
}

// Relative luminance of linear Rec. 709 primaries.
float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

float max_component(vec3 c) { return max(c.r, max(c.g, c.b)); }

#endif
