#version 460
// Test of the random numbers: what `count` frames from `first` on draw at each of some pixels.
#include "common/bindless.glsl"
#define RANDOM_WITHOUT_VIEW
#include "trace/random.glsl"

layout(local_size_x = 64) in;

// In the order in which they are drawn.
struct Drawn {
    vec2 pair;
    float single;
    vec2 second_pair;
    float independent;
    uint picked;   // of seven, by a number of its own
    float left;    // what is left of that
    uint happened; // with a chance of 0.3, by what is left
    float last;    // what is left of that
};

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Draws { Drawn at[]; };
layout(push_constant, scalar) uniform Push { Draws draws; uint first; uint count; uint pixels; uint stream; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= count * pixels) return;
    uint pixel = index / count;
    rng_begin(uvec2(pixel % 64, pixel / 64), first + index % count, stream);
    Drawn d;
    d.pair = rng_next2();
    d.single = rng_next();
    d.second_pair = rng_next2();
    d.independent = rng_independent();
    float u = rng_next();
    d.picked = rng_pick(u, 7);
    d.left = u;
    d.happened = uint(rng_decide(u, 0.3));
    d.last = u;
    draws.at[index] = d;
}
