#version 460
// Runs only if the depth test passes; marks the flare as visible.
#include "raster/flares.glsl"

layout(early_fragment_tests) in;
layout(push_constant, scalar) uniform Push { uint64_t flares; uint64_t states; vec2 size; } push;
layout(location = 0) in flat uint in_slot;

void main() {
    FlareStates(push.states).at[in_slot].seen = 1;
}
