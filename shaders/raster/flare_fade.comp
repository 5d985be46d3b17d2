#version 460
// Fades flares in and out and writes the squares to draw.
#include "raster/flares.glsl"

layout(local_size_x = 64) in;
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Vertices { Vertex at[]; };
layout(push_constant, scalar) uniform Push {
    uint64_t flares; uint64_t states; uint64_t vertices; uint count; int time; float speed;
} push;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) return;
    Flare flare = Flares(push.flares).at[index];
    FlareState state = FlareStates(push.states).at[flare.slot];
    // a new flare starts as one that has been hidden for 2000 ms
    if (flare.fresh != 0) { state.visible = 0; state.since = push.time - 2000; }
    if (state.seen != state.visible) { state.visible = state.seen; state.since = push.time - 1; }
    state.seen = 0;
    FlareStates(push.states).at[flare.slot] = state;
    float fade = float(push.time - state.since) / 1000.0 * push.speed;
    fade = clamp(state.visible != 0 ? fade : 1.0 - fade, 0.0, 1.0);
    // a square without brightness has size 0
    float size = fade > 0.0 ? flare.size : 0.0;
    uvec3 color = uvec3(clamp(flare.color * fade, 0.0, 255.0));
    // corners of the square in the engine's order, clockwise from the lower left
    const vec2 corners[4] = vec2[](vec2(-1.0, 1.0), vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0));
    const vec2 st[4] = vec2[](vec2(0.0, 0.0), vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0));
    for (uint i = 0; i < 4; i++) {
        Vertices(push.vertices).at[index * 4 + i] = Vertex(vec3(flare.center + corners[i] * size, 0.0), vec3(0.0, 0.0, -1.0),
            st[i], vec2(0.0), color.r | color.g << 8 | color.b << 16 | 0xFF000000u);
    }
}
