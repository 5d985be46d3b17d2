#version 460
// Miss of a ray for translucent layers: keeps the layers in the payload.
#extension GL_EXT_ray_tracing : require

void main() {}
