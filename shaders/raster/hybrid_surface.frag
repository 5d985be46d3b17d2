#version 460
// Normal of the triangle on the viewer's side, and 1 over the depth; with MIRROR, the normal of the vertices.
// variants: MIRROR=-DMIRROR
#include "raster/draw.glsl"
#include "trace/direction.glsl"

layout(location = 0) in vec3 in_world;
layout(location = 1) in float in_clip;
#ifdef MIRROR
layout(location = 2) in vec3 in_normal;
layout(location = 3) in flat float in_first_person;
#endif
layout(location = 0) out vec4 out_surface;

void main() {
    vec3 normal = cross(dFdx(in_world), dFdy(in_world));
    if (CLIP != 0 && in_clip < 0.0) discard;
    if (dot(normal, VIEW.origin - in_world) < 0.0) normal = -normal;
    normal = safe_normalize(normal, vec3(0.0, 0.0, 1.0));
    float mark = 0.0;
#ifdef MIRROR
    normal = safe_normalize(in_normal, normal);
    mark = in_first_person;
#endif
    out_surface = vec4(octahedral(normal), mark, gl_FragCoord.w);
}
