// Time of a pass's invocations, for the views of time of `rt_debug`: clock of the subgroup at the end of the invocation
// minus that at its start, so that it includes the wait for other invocations of the subgroup. Devices without
// `VK_KHR_shader_clock` get modules without the instruction (`gpu/spirv.rs`), and never TIMED.
#ifndef RELIGHT_TRACE_CLOCK_GLSL
#define RELIGHT_TRACE_CLOCK_GLSL
#extension GL_ARB_shader_clock : require

#include "trace/view.glsl"

// 1: the time is measured.
layout(constant_id = 5) const uint TIMED = 0;

// The low word: differences are exact up to 2^32 ticks.
uint clock_now() {
    if (TIMED == 0) return 0;
    return clock2x32ARB().x;
}

uint invocation_start = clock_now();
// Ticks between start and end of the invocation's rays.
uint ray_ticks = 0;

// The image holds `TIMED_FRAMES` times a mean over frames, in which a frame weighs 1 / TIMED_FRAMES. The first pass of
// a frame takes that part from the pixel.
void begin_pixel_time(ivec2 pixel) {
    if (TIMED == 0) return;
    uint before = imageLoad(uimages_r32ui[VIEW.post.image_time], pixel).x;
    imageStore(uimages_r32ui[VIEW.post.image_time], pixel, uvec4(before - before / TIMED_FRAMES));
}

// Adds the ticks of this invocation, or of its rays, to those of a pixel.
void add_pixel_time(ivec2 pixel) {
    if (TIMED == 0) return;
    uint ticks = VIEW.post.debug == DEBUG_RAY_TIME ? ray_ticks : clock_now() - invocation_start;
    imageAtomicAdd(uimages_r32ui[VIEW.post.image_time], pixel, ticks);
}

#endif
