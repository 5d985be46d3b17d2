// Surfaces of glass and liquids: how much they reflect, and how ripples turn them.
#ifndef RELIGHT_TRACE_DIELECTRIC_GLSL
#define RELIGHT_TRACE_DIELECTRIC_GLSL

// Part of unpolarized light that a smooth surface reflects: Fresnel's equations for dielectrics. `cosine`: between ray
// and normal; `eta`: index behind the surface over the one in front. 1 for total reflection.
float fresnel(float cosine, float eta) {
    float sine_squared = (1.0 - cosine * cosine) / (eta * eta);
    if (sine_squared >= 1.0) return 1.0;
    float refracted = sqrt(1.0 - sine_squared);
    float across = (cosine - eta * refracted) / (cosine + eta * refracted);
    float along = (eta * cosine - refracted) / (eta * cosine + refracted);
    return 0.5 * (across * across + along * along);
}

// Of a pane: light that its faces throw to and fro leaves on either side, which sums up to a geometric series.
float fresnel_pane(float one_face) { return 2.0 * one_face / (1.0 + one_face); }

// The engine's gravity, units per second squared: it sets the pace of waves in deep water, frequency squared = gravity
// times wave number.
const float WAVE_GRAVITY = 800.0;
const uint WAVE_COUNT = 5;

// The normal of a liquid whose ripples are a sum of sine waves of root mean square slope `slope`; each next one is
// shorter and turned by the golden angle, so that they never line up. Waves shorter than the ray's footprint (`width`,
// units) are averaged away.
vec3 ripple_normal(vec3 n, vec3 position, float depth_gradient, float width, float time) {
    if (!(depth_gradient > 0.0)) return n;
    vec3 t = normalize(abs(n.z) > 0.7 ? cross(vec3(0.0, 1.0, 0.0), n) : cross(vec3(0.0, 0.0, 1.0), n));
    vec3 b = cross(n, t);
    vec2 place = vec2(dot(position, t), dot(position, b));
    vec2 gradient = vec2(0.0);
    float wave_length = 110.0, angle = 0.4;
    float amplitude = depth_gradient * sqrt(2.0 / float(WAVE_COUNT));
    for (uint i = 0; i < WAVE_COUNT; i++) {
        float k = 6.2831853 / wave_length;
        vec2 along = vec2(cos(angle), sin(angle));
        float blur = 0.5 * k * width;
        // whole turns are taken out of the time's part first, so that long uptime costs no digits
        float turns = fract(time * sqrt(WAVE_GRAVITY * k) / 6.2831853);
        gradient += along * (amplitude * exp(-0.5 * blur * blur) * cos(k * dot(along, place) + 6.2831853 * turns));
        wave_length *= 0.63;
        angle += 2.3999632;
    }
    return normalize(n - t * gradient.x - b * gradient.y);
}

#endif
