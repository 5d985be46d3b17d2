#version 460
// The ray hit nothing.
#extension GL_EXT_ray_tracing : require
#include "trace/payload.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;

void main() { payload.geometry = NO_HIT; }
