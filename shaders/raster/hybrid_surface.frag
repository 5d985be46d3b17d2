#version 460
// Normal of the triangle on the viewer's side, and 1 over the depth.
#include "raster/draw.glsl"
#include "trace/direction.glsl"

layout(location = 0) in vec3 in_world;
layout(location = 1) in float in_clip;
layout(location = 0) out vec4 out_surface;

void main() {
    vec3 normal = cross(dFdx(in_world), dFdy(in_world));
    if (CLIP != 0 && in_clip < 0.0) discard;
    if (dot(normal, VIEW.origin - in_world) < 0.0) normal = -normal;
    out_surface = vec4(octahedral(safe_normalize(normal, vec3(0.0, 0.0, 1.0))), 0.0, gl_FragCoord.w);
}
