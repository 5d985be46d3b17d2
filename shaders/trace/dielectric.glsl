// Glass and liquids: reflectance, and normals of ripples.
#ifndef RELIGHT_TRACE_DIELECTRIC_GLSL
#define RELIGHT_TRACE_DIELECTRIC_GLSL

#include "trace/geometry.glsl"

// Reflectance of a smooth surface for unpolarized light: Fresnel's equations for dielectrics. `cosine`: between ray and
// normal; `eta`: index behind the surface over the index in front. 1: total reflection.
float fresnel(float cosine, float eta) {
    float sine_squared = (1.0 - cosine * cosine) / (eta * eta);
    if (sine_squared >= 1.0) return 1.0;
    float refracted = sqrt(1.0 - sine_squared);
    float across = (cosine - eta * refracted) / (cosine + eta * refracted);
    float along = (eta * cosine - refracted) / (eta * cosine + refracted);
    return 0.5 * (across * across + along * along);
}

// Reflectance of a pane: the geometric series of reflections between its faces.
float fresnel_pane(float one_face) { return 2.0 * one_face / (1.0 + one_face); }

// Whether rays bend at the surface: of liquids and closed bodies of glass. Other glass is panes: the second face, usually
// culled, reverses the refraction of the first, so rays pass straight.
bool refracts(Material material, SurfacePoint p) {
    return (material.flags & MATERIAL_LIQUID) != 0 || (p.triangle.flags & TRIANGLE_SOLID) != 0;
}

// Reflectance of glass or a liquid's surface; of both faces of a pane that shows one. `eta`: as for `fresnel`.
float dielectric_reflectance(Material material, SurfacePoint p, float cosine, float eta) {
    float one_face = fresnel(min(cosine, 1.0), eta);
    bool pane = !refracts(material, p) && (material.flags & MATERIAL_TWO_SIDED) == 0;
    return pane ? fresnel_pane(one_face) : one_face;
}

// The engine's gravity, units per second squared; gives the frequency of deep-water waves: frequency squared = gravity
// times wave number.
const float WAVE_GRAVITY = 800.0;
const uint WAVE_COUNT = 5;

// Normal of a liquid whose ripples are a sum of sine waves with the root mean square slope `slope`. Each wave is
// shorter than the previous one and rotated by the golden angle, so that they never align. Waves shorter than the
// footprint of the ray (`width`, units) are averaged out.
vec3 ripple_normal(vec3 n, vec3 position, float slope, float width, float time) {
    if (!(slope > 0.0)) return n;
    vec3 t = normalize(abs(n.z) > 0.7 ? cross(vec3(0.0, 1.0, 0.0), n) : cross(vec3(0.0, 0.0, 1.0), n));
    vec3 b = cross(n, t);
    vec2 place = vec2(dot(position, t), dot(position, b));
    vec2 gradient = vec2(0.0);
    float wave_length = 110.0, angle = 0.4;
    float amplitude = slope * sqrt(2.0 / float(WAVE_COUNT));
    for (uint i = 0; i < WAVE_COUNT; i++) {
        float k = 6.2831853 / wave_length;
        vec2 along = vec2(cos(angle), sin(angle));
        float blur = 0.5 * k * width;
        // removes whole periods of time first, so that long uptime loses no precision
        float turns = fract(time * sqrt(WAVE_GRAVITY * k) / 6.2831853);
        gradient += along * (amplitude * exp(-0.5 * blur * blur) * cos(k * dot(along, place) + 6.2831853 * turns));
        wave_length *= 0.63;
        angle += 2.3999632;
    }
    return normalize(n - t * gradient.x - b * gradient.y);
}

#endif
