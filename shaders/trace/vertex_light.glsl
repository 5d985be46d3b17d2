// Light at vertices of the map's triangles: irradiance over pi by the map's constant lights and by all bounces (Willberger,
// Musterle, Bergmann, Deferred Hybrid Path Tracing, Ray Tracing Gems, 2019, section 26.2). `vertex_gather.rgen` computes it
// once; bounces that hit the map take it in place of a light sample.
#ifndef RELIGHT_TRACE_VERTEX_LIGHT_GLSL
#define RELIGHT_TRACE_VERTEX_LIGHT_GLSL

#include "trace/lights.glsl"
#include "trace/bounce.glsl"

// 1: bounces take the light of vertices. 0 removes the code.
layout(constant_id = 17) const uint VERTEX_LIGHT = 0;

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer LightGrids { LightGrid at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer VertexLights { uint at[]; };

// Red, green and blue with eight bits and a common exponent, and the bits CELL_* of the cells that start at the vertex.
uint pack_vertex_light(vec3 light, uint cells) {
    light = clamp(light, 0.0, 65000.0);
    float largest = max_component(light);
    int exponent = clamp(int(floatBitsToUint(largest) >> 23) - 126, -31, 32);
    uvec3 mantissas = uvec3(min(light * exp2(float(8 - exponent)) + 0.5, 255.0));
    return mantissas.r | mantissas.g << 8 | mantissas.b << 16 | uint(exponent + 31) << 24 | cells << 30;
}

vec3 unpack_vertex_light(uint packed) {
    float scale = exp2(float(int(packed >> 24 & 63u) - 31 - 8));
    return vec3(packed & 255u, packed >> 8 & 255u, packed >> 16 & 255u) * scale;
}

// Number of the vertices of a grid before a row; of all, for the row behind the last.
uint vertices_before(uint row, uint segments) { return row * (segments + 1) - row * (row - 1) / 2; }

uint grid_vertices(uint segments) { return vertices_before(segments + 1, segments); }

// Index of a vertex in its grid.
uint grid_place(ivec2 at, uint segments) { return vertices_before(uint(at.y), segments) + uint(at.x); }

// Number of a hit triangle among the world's; the number of these for any other.
uint world_triangle(Hit hit) {
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    uint64_t first = record.triangles - VIEW.vertex_light.triangles; // wraps below
    const uint64_t TRIANGLE_BYTES = 32ul;
    if (first >= uint64_t(VIEW.vertex_light.world_count) * TRIANGLE_BYTES) return VIEW.vertex_light.world_count;
    return uint(first / TRIANGLE_BYTES) + hit.primitive;
}

// The face normal of a triangle of the world.
vec3 world_face(uint number) {
    Triangle triangle = Triangles(VIEW.vertex_light.triangles).at[number];
    TraceVertices vertices = TraceVertices(VIEW.vertex_light.vertices);
    vec3 a = vertices.at[triangle.indices[0]].position;
    return cross(vertices.at[triangle.indices[2]].position - a, vertices.at[triangle.indices[1]].position - a);
}

// Light at a hit, on the side of `face_normal`. False: the hit surface has no vertices, or a wall crosses the cell.
bool vertex_light_at(Hit hit, vec3 face_normal, out vec3 light) {
    light = vec3(0.0);
    uint number = world_triangle(hit);
    if (number >= VIEW.vertex_light.grid_count) return false;
    LightGrid grid = LightGrids(VIEW.vertex_light.grids).at[number];
    uint segments = grid.segments & GRID_SEGMENTS;
    if (segments == 0) return false;
    if ((grid.segments & GRID_TWO_SIDED) != 0 && dot(world_face(number), face_normal) < 0.0) grid.first += grid_vertices(segments);
    vec2 place = clamp(hit.barycentrics, 0.0, 1.0) * float(segments);
    ivec2 at = min(ivec2(place), ivec2(segments - 1));
    at.x = min(at.x, int(segments) - 1 - at.y);
    vec2 part = clamp(place - vec2(at), 0.0, 1.0);
    bool down = part.x + part.y > 1.0 && at.x + at.y + 2 <= int(segments);
    VertexLights lights = VertexLights(VIEW.vertex_light.light);
    uint corner = lights.at[grid.first + grid_place(at, segments)];
    if ((corner >> 30 & (down ? CELL_DOWN : CELL_UP)) == 0) return false;
    vec3 beside = unpack_vertex_light(lights.at[grid.first + grid_place(at + ivec2(1, 0), segments)]);
    vec3 above = unpack_vertex_light(lights.at[grid.first + grid_place(at + ivec2(0, 1), segments)]);
    if (down) {
        vec3 opposite = unpack_vertex_light(lights.at[grid.first + grid_place(at + ivec2(1), segments)]);
        light = opposite * (part.x + part.y - 1.0) + beside * (1.0 - part.y) + above * (1.0 - part.x);
    } else light = unpack_vertex_light(corner) * max(1.0 - part.x - part.y, 0.0) + beside * part.x + above * part.y;
    return true;
}

// Whether a light moves or changes, so that vertices do not have it.
bool is_changing(uint light) { return light_kind(light) == LIGHT_CHANGING_TRIANGLE || light_kind(light) == LIGHT_CHANGING_SPHERE; }

// A light sample of those lights.
LightSample changing_light(PathVertex v) {
    if (VIEW.vertex_light.changing == 0 && VIEW.lights.dynamic_row_count == 0) return no_light();
    LightSet set = lights_at(v.position, v.face_normal, v.normal);
    if (VIEW.vertex_light.changing == 0) {
        set.listed = 0;
        set.suns = 0;
        set.parent = NO_PARENT;
    }
    vec2 u;
    LightChoice choice = one_choice(set, v.position, v.normal, u);
    if (!(choice.weight > 0.0) || !is_changing(choice.light)) return no_light();
    LightSample s = sample_light(choice.light, v.position, v.normal, u);
    s.light *= choice.weight;
    return s;
}

#endif
