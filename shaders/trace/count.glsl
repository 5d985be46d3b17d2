// Counts the rays of a pass. The counters exist only while something reads them.
#ifndef RELIGHT_TRACE_COUNT_GLSL
#define RELIGHT_TRACE_COUNT_GLSL

#include "trace/view.glsl"
#include "trace/clock.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer RayCounters { uint at[]; };

// Rays of this invocation.
uint ray_count = 0;

// Adds the rays of this invocation to the counters of its pass (`COUNT_*`) and to the count of its pixel, which the
// first pass resets; and its time to that of the pixel.
void count_rays(ivec2 pixel, uint pass, bool first) {
    if (first) begin_pixel_time(pixel);
    add_pixel_time(pixel);
    if (VIEW.post.counters != 0 && ray_count > 0) {
        // several counters per pass reduce contention and prevent overflow
        uint row = uint(pixel.y) % COUNTER_ROWS;
        atomicAdd(RayCounters(VIEW.post.counters).at[pass * COUNTER_ROWS + row], ray_count);
    }
    if (VIEW.post.image_rays != NO_IMAGE) {
        uint before = first ? 0 : imageLoad(uimages_r32ui[VIEW.post.image_rays], pixel).x;
        imageStore(uimages_r32ui[VIEW.post.image_rays], pixel, uvec4(before + ray_count));
    }
}

#endif
