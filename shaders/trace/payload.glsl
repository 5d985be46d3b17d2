// What travels with a ray of the pipeline tracer.
#ifndef RELIGHT_TRACE_PAYLOAD_GLSL
#define RELIGHT_TRACE_PAYLOAD_GLSL

#include "trace/candidate.glsl"

// Of a ray for what stops it.
struct Payload {
    float t;
    uint geometry;
    uint primitive;
    vec2 barycentrics;
};

// Of a ray for translucent layers: the nearest so far, and the one that they must lie behind.
struct LayerPayload {
    LayerList found;
    LayerOrder last;
};

#endif
