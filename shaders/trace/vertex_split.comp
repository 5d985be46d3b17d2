#version 460
// Makes the vertices of the map's triangles; then doubles the segments of triangles where the light of neighbouring vertices
// differs, or where a wall crosses cells.
#include "trace/vertex_grid.glsl"

layout(local_size_x = 8, local_size_y = 4) in;

// Longest and shortest edge of cells, units.
const float LONGEST = 96.0, SHORTEST = 16.0;
// Difference of the light of neighbours, as a part of the larger, from which on a triangle is split; and the least one, of
// display white.
const float DIFFERENCE = 0.25, LEAST_DIFFERENCE = 0.02;

float longest_edge(Triangle triangle) {
    TraceVertices vertices = TraceVertices(VIEW.vertex_light.vertices);
    float longest = 0.0;
    for (uint i = 0; i < 3; i++) {
        vec3 from = vertices.at[triangle.indices[i]].position, to = vertices.at[triangle.indices[(i + 1) % 3]].position;
        longest = max(longest, distance(from, to));
    }
    return longest;
}

// Gives a triangle a grid, if there is room for it.
void make_grid(uint number, uint segments, bool two_sided) {
    VerticesUsed used = VerticesUsed(VIEW.vertex_light.used);
    uint capacity = VIEW.vertex_light.capacity, count = grid_vertices(segments) * (two_sided ? 2 : 1);
    if (used.count > capacity) return;
    uint first = atomicAdd(used.count, count);
    if (first > capacity || count > capacity - first) return;
    for (uint i = 0; i < count; i++) {
        VertexOwners(VIEW.vertex_light.owners).at[first + i] = number;
        VertexSums(VIEW.vertex_light.sums).at[first + i] = VertexSum(vec3(0.0), 0.0, vec3(0.0), 0.0, 0.0, 0);
    }
    LightGrids(VIEW.vertex_light.grids).at[number] = LightGrid(first, segments | (two_sided ? GRID_TWO_SIDED : 0));
}

// Whether the light of two vertices differs too much for interpolation.
bool differ(float a, float b) {
    float least = LEAST_DIFFERENCE * exp2(-VIEW.exposure.base);
    return abs(a - b) > max(DIFFERENCE * max(a, b), least);
}

// Whether a side of a triangle needs smaller cells.
bool needs_split(uint first, uint segments) {
    for (int y = 0; y < int(segments); y++) for (int x = 0; x + y < int(segments); x++) {
        uint places[3] = uint[](grid_place(ivec2(x, y), segments), grid_place(ivec2(x + 1, y), segments), grid_place(ivec2(x, y + 1), segments));
        uint corner = VertexLights(VIEW.vertex_light.light).at[first + places[0]];
        float light[3];
        bool some = false, all = true;
        for (uint i = 0; i < 3; i++) {
            bool open = is_open(VertexSums(VIEW.vertex_light.sums).at[first + places[i]]);
            some = some || open;
            all = all && open;
            light[i] = luminance(unpack_vertex_light(VertexLights(VIEW.vertex_light.light).at[first + places[i]]));
        }
        if (some && (corner >> 30 & CELL_UP) == 0) return true;
        if (all && (differ(light[0], light[1]) || differ(light[1], light[2]) || differ(light[2], light[0]))) return true;
    }
    return false;
}

void main() {
    uint number = gl_GlobalInvocationID.y * VERTEX_ROW + gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= VERTEX_ROW || number >= VIEW.vertex_light.grid_count) return;
    Triangle triangle = Triangles(VIEW.vertex_light.triangles).at[number];
    float longest = longest_edge(triangle);
    if (push.number == 0) {
        bool two_sided = (material_of(triangle.material).flags & MATERIAL_TWO_SIDED) != 0 && (triangle.flags & TRIANGLE_ONE_SIDED) == 0;
        make_grid(number, uint(clamp(ceil(longest / LONGEST), 1.0, float(GRID_MOST))), two_sided);
        return;
    }
    LightGrid grid = LightGrids(VIEW.vertex_light.grids).at[number];
    uint segments = grid.segments & GRID_SEGMENTS;
    bool two_sided = (grid.segments & GRID_TWO_SIDED) != 0;
    if (segments == 0 || 2 * segments > GRID_MOST || longest < 2.0 * SHORTEST * float(segments)) return;
    bool split = needs_split(grid.first, segments);
    if (!split && two_sided) split = needs_split(grid.first + grid_vertices(segments), segments);
    if (split) make_grid(number, 2 * segments, two_sided);
}
