// What travels with a ray of the pipeline tracer.
#ifndef RELIGHT_TRACE_PAYLOAD_GLSL
#define RELIGHT_TRACE_PAYLOAD_GLSL

struct Payload {
    float t;
    uint geometry;
    uint primitive;
    vec2 barycentrics;
    // translucent layers: the best one so far, and the one that it must lie behind
    float key;
    float last_key;
    uint last_geometry;
    uint last_primitive;
};

#endif
