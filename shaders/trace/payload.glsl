// Ray payloads of the pipeline tracer.
#ifndef RELIGHT_TRACE_PAYLOAD_GLSL
#define RELIGHT_TRACE_PAYLOAD_GLSL

#include "trace/candidate.glsl"

// Payload of a ray for the nearest solid hit.
struct Payload {
    float t;
    uint geometry;
    uint primitive;
    vec2 barycentrics;
};

// Payload of a ray for translucent layers: the nearest found so far; they must lie behind `last`.
struct LayerPayload {
    LayerList found;
    LayerOrder last;
};

#endif
