#version 460
// Reports the hit; shades nothing.
#extension GL_EXT_ray_tracing : require
#include "trace/payload.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload.geometry = uint(gl_InstanceCustomIndexEXT) + uint(gl_GeometryIndexEXT);
    payload.primitive = uint(gl_PrimitiveID);
    payload.barycentrics = barycentrics;
    payload.t = gl_HitTEXT;
}
