// The vertices of the map's triangles while their light is computed.
#ifndef RELIGHT_TRACE_VERTEX_GRID_GLSL
#define RELIGHT_TRACE_VERTEX_GRID_GLSL

#include "trace/vertex_light.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer VertexOwners { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer VertexSums { VertexSum at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer VerticesUsed { uint count; };

// A vertex, by its place in the grid of its triangle.
struct GridVertex {
    uint triangle;
    uint segments;
    uint first; // of the vertices of its side
    ivec2 at;
    bool back;
};

// False: the number is of no vertex, or of one whose triangle has another grid now.
bool grid_vertex(uint number, out GridVertex v) {
    if (number >= min(VerticesUsed(VIEW.vertex_light.used).count, VIEW.vertex_light.capacity)) return false;
    v.triangle = VertexOwners(VIEW.vertex_light.owners).at[number];
    LightGrid grid = LightGrids(VIEW.vertex_light.grids).at[v.triangle];
    v.segments = grid.segments & GRID_SEGMENTS;
    if (v.segments == 0 || number < grid.first) return false;
    uint count = grid_vertices(v.segments), local = number - grid.first;
    v.back = local >= count;
    if (v.back && (grid.segments & GRID_TWO_SIDED) == 0) return false;
    v.first = v.back ? grid.first + count : grid.first;
    local = number - v.first;
    if (local >= count) return false;
    uint row = 0;
    while (vertices_before(row + 1, v.segments) <= local) row++;
    v.at = ivec2(local - vertices_before(row, v.segments), row);
    return true;
}

bool in_grid(ivec2 at, uint segments) { return at.x >= 0 && at.y >= 0 && at.x + at.y <= int(segments); }

// Whether the samples of a vertex lie outside of bodies.
bool is_open(VertexSum sum) { return sum.samples > sum.inside; }

vec3 mean_light(VertexSum sum) {
    vec3 light = sum.direct / max(sum.samples, 1.0);
    if (sum.bounce_samples > 0.0) light += sum.bounced / sum.bounce_samples;
    return finite_light(light);
}

#endif
