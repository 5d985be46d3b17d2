// Depth gradient: change of the surface's depth from a pixel to its neighbours; distinguishes a plane from an edge.
#ifndef RELIGHT_TRACE_DEPTH_GRADIENT_GLSL
#define RELIGHT_TRACE_DEPTH_GRADIENT_GLSL

#include "trace/denoise.glsl"
#include "trace/motion.glsl"

// Edge of a work group.
#ifndef TILE
#define TILE 8
#endif
layout(local_size_x = TILE, local_size_y = TILE) in;

// Depths of the work group's pixels and of those around them; 0: no surface.
shared float depths[(TILE + 2) * (TILE + 2)];

float depth_at(ivec2 pixel) {
    if (!inside(pixel)) return 0.0;
    float view_distance = lit_distance_read(pixel, distance_tail_read(pixel));
    return view_distance < 0.0 ? 0.0 : max(depth_of(pixel, view_distance), 1.0e-3);
}

// Must be called by the whole work group.
void load_depths() {
    ivec2 corner = ivec2(gl_WorkGroupID.xy) * TILE - 1;
    for (int i = int(gl_LocalInvocationIndex); i < (TILE + 2) * (TILE + 2); i += TILE * TILE)
        depths[i] = depth_at(corner + ivec2(i % (TILE + 2), i / (TILE + 2)));
    barrier();
}

int own_place() { return (int(gl_LocalInvocationID.y) + 1) * (TILE + 2) + int(gl_LocalInvocationID.x) + 1; }
float own_depth() { return depths[own_place()]; }

// The smaller of two changes: an edge on one side does not count.
float smaller_change(float a, float b) { return abs(a) < abs(b) ? a : b; }

// Relative change of inverse depth per pixel. The inverse depth of a plane is linear on the screen, also in a flat
// mirror. `takes_turns`: direct neighbours show the other field's surface, diagonal ones the same surface.
vec2 depth_gradient_at(float depth, bool takes_turns) {
    const int ROW = TILE + 2;
    int place = own_place(), first = takes_turns ? ROW + 1 : 1, second = takes_turns ? ROW - 1 : ROW;
    vec4 around = vec4(depths[place - first], depths[place + first], depths[place - second], depths[place + second]);
    vec4 change = depth / max(around, 1.0e-3) - 1.0;
    change = mix(change, vec4(1.0e3), equal(around, vec4(0.0)));
    vec2 depth_gradient = vec2(smaller_change(-change.x, change.y), smaller_change(-change.z, change.w));
    depth_gradient = mix(depth_gradient, vec2(0.0), greaterThanEqual(abs(depth_gradient), vec2(1.0)));
    // from diagonals to rows and columns
    return takes_turns ? 0.5 * vec2(depth_gradient.x - depth_gradient.y, depth_gradient.x + depth_gradient.y) : depth_gradient;
}

#endif
