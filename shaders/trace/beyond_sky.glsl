// Surfaces visible through a sky. The engine draws a sky behind everything else, wherever its surfaces are, so surfaces
// behind a sky are visible if the map's visible set holds them. Only primary rays that nothing has redirected continue
// behind a sky.
#ifndef RELIGHT_TRACE_BEYOND_SKY_GLSL
#define RELIGHT_TRACE_BEYOND_SKY_GLSL

#include "trace/boxes.glsl"
#include "trace/geometry.glsl"

// Surfaces less than this behind a sky count as part of it, units along the ray.
const float IN_SKY = 0.25;

// Whether a ray that hits a sky at `t` may hit a visible surface behind it.
bool meets_beyond_sky(vec3 origin, vec3 direction, float t) {
    uint count = VIEW.transport.beyond_count;
    // skips boxes that end at the sky
    vec3 start = origin + direction * (t + IN_SKY + 1.0e-5 * t);
    return count > 0 && meets_box(Boxes(VIEW.transport.beyond), count, start, direction, FAR);
}

// Whether the visible set holds the surface of the point. Moving objects are always visible.
bool shows_beyond_sky(SurfacePoint p) {
    if ((p.triangle.flags & TRIANGLE_STATIC) == 0 || p.instance != 0) return true;
    uint surface = p.triangle.instance;
    if (surface >= VIEW.transport.beyond_surface_count) return false;
    return (Indices(VIEW.transport.beyond_surfaces).at[surface / 32] >> (surface % 32) & 1u) != 0;
}

#endif
