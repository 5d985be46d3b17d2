#version 460
// Test of the gpu layer: see rays.glsl.
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec4 payload;
hitAttributeEXT vec2 barycentrics;

void main() {
    payload = uvec4(1, gl_InstanceCustomIndexEXT, gl_PrimitiveID, gl_HitKindEXT);
}
