#version 460
// The end of a ray for translucent layers: what it found is in the payload, and stays.
#extension GL_EXT_ray_tracing : require

void main() {}
