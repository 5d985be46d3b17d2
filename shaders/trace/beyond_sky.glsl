// What shows through a sky. The engine draws a sky behind everything else, wherever its surfaces are: what lies behind
// them shows, too, if the map's visible set holds it. Rays of the eye alone, those that nothing has turned, go on there.
#ifndef RELIGHT_TRACE_BEYOND_SKY_GLSL
#define RELIGHT_TRACE_BEYOND_SKY_GLSL

#include "trace/boxes.glsl"
#include "trace/geometry.glsl"

// What lies less far behind a sky, units along the ray, is taken for a part of it.
const float IN_SKY = 0.25;

// Whether a ray that meets a sky at `t` may meet something behind it that shows.
bool meets_beyond_sky(vec3 origin, vec3 direction, float t) {
    uint count = VIEW.transport.beyond_count;
    // a box that ends at the sky is before it
    vec3 start = origin + direction * (t + IN_SKY + 1.0e-5 * t);
    return count > 0 && meets_box(Boxes(VIEW.transport.beyond), count, start, direction, FAR);
}

// Whether the visible set holds the surface of a point. What moves is in sight wherever the game has put it there.
bool shows_beyond_sky(SurfacePoint p) {
    if ((p.triangle.flags & TRIANGLE_STATIC) == 0 || p.instance != 0) return true;
    uint surface = p.triangle.instance;
    if (surface >= VIEW.transport.beyond_surface_count) return false;
    return (Indices(VIEW.transport.beyond_surfaces).at[surface / 32] >> (surface % 32) & 1u) != 0;
}

#endif
