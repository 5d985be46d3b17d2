#version 460
// Nothing was hit. A translucent layer found on the way (key below the start value) is kept.
#extension GL_EXT_ray_tracing : require
#include "trace/payload.glsl"

layout(location = 0) rayPayloadInEXT Payload payload;

void main() {
    if (payload.key >= 1.0e30) payload.geometry = 0xFFFFFFFFu;
}
