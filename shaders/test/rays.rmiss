#version 460
// Test of the gpu layer: see rays.glsl.
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec4 payload;

void main() {
    payload = uvec4(0);
}
