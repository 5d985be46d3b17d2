// How samples of lights and rays of rough surfaces share the light that both find. The shares of a direction add up to 1,
// and follow the power heuristic for about the densities of both.
#ifndef RELIGHT_TRACE_SPECULAR_LIGHTS_GLSL
#define RELIGHT_TRACE_SPECULAR_LIGHTS_GLSL

#include "trace/lights.glsl"
#include "trace/specular.glsl"

// Assumed probability with which a triangle is the sampled light. The exact one depends on random candidates; another
// number changes the noise, not the mean.
const float ASSUMED_CHANCE = 0.25;

// Density of samples on a triangle, per solid angle.
float triangle_density(float away, float facing, float area) {
    return ASSUMED_CHANCE * away * away / max(facing * area, 1.0e-12);
}

float sun_density(SunLight sun) { return 1.0 / (2.0 * PI * max(1.0 - sun.cos_angle, 1.0e-9)); }

float triangle_area(SurfacePoint p) {
    TraceVertices vertices = TraceVertices(p.vertices);
    vec3 a = vertices.at[p.triangle.indices[0]].position, b = vertices.at[p.triangle.indices[1]].position;
    return 0.5 * length(cross(b - a, vertices.at[p.triangle.indices[2]].position - a));
}

// The part of the light that the ray counts. `sampled`: density of the light's samples.
float ray_share(float ray, float sampled) {
    if (!soft_shadows() || VIEW.transport.specular_estimator == SPECULAR_LIGHTS) return 0.0;
    if (VIEW.transport.specular_estimator == SPECULAR_RAYS) return 1.0;
    float ratio = sampled / max(ray, 1.0e-20);
    return 1.0 / (1.0 + ratio * ratio);
}

// The same for a sample of a light; 0 for lights that no ray meets.
float ray_share_of(uint light, vec3 position, vec3 direction, float ray) {
    uint kind = light_kind(light);
    if (kind == LIGHT_SUN) {
        SunLight sun = SunLights(VIEW.lights.suns).at[light_index(light)];
        return sun.cos_angle < 1.0 ? ray_share(ray, sun_density(sun)) : 0.0;
    }
    if (kind != LIGHT_TRIANGLE) return 0.0;
    TriangleLight triangle = triangle_light(light);
    if ((triangle.flags & LIGHT_HITTABLE) == 0) return 0.0;
    vec3 a = triangle.corners[0] - position;
    vec3 face = cross(triangle.corners[1] - triangle.corners[0], triangle.corners[2] - triangle.corners[0]);
    float double_area = length(face), height = abs(dot(a, face)) / max(double_area, 1.0e-20);
    float facing = abs(dot(direction, face)) / max(double_area, 1.0e-20);
    return ray_share(ray, triangle_density(height / max(facing, 1.0e-7), facing, 0.5 * double_area));
}

#endif
