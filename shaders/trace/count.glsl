// How many rays a pass asks for. The counters are there only while somebody wants to know.
#ifndef RELIGHT_TRACE_COUNT_GLSL
#define RELIGHT_TRACE_COUNT_GLSL

#include "trace/view.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer RayCounters { uint at[]; };

// Rays that this invocation has asked for; every function of the tracer that starts one adds to it.
uint rays_asked = 0;

// Adds what this invocation asked for to the counters of its pass (COUNT_*), and to its pixel's number, which begins with
// the first pass.
void count_rays(ivec2 pixel, uint pass, bool first) {
    if (VIEW.post.counters != 0 && rays_asked > 0) {
        // several counters for a pass: fewer invocations meet at each, and none overflows
        uint row = uint(pixel.y) % COUNTER_ROWS;
        atomicAdd(RayCounters(VIEW.post.counters).at[pass * COUNTER_ROWS + row], rays_asked);
    }
    if (VIEW.post.image_rays != NO_IMAGE) {
        uint before = first ? 0 : imageLoad(uimages_r32ui[VIEW.post.image_rays], pixel).x;
        imageStore(uimages_r32ui[VIEW.post.image_rays], pixel, uvec4(before + rays_asked));
    }
}

#endif
