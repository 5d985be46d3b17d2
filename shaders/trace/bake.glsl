// Points of a bake, their lists of lights, and the sums of their light.
#ifndef RELIGHT_TRACE_BAKE_GLSL
#define RELIGHT_TRACE_BAKE_GLSL

#include "trace/lights.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BakeViews { BakeView bake; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BakePoints { BakePoint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BakePointLights { BakePointLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BakeTriangles { BakeTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer BakeLights { BakeLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer BakeEstimates { BakeEstimate at[]; };

#define BAKE (BakeViews(push.bake).bake)

// Rays start at this distance, units, so that a point in the plane of a surface, such as one of the light grid, is not in
// its shadow. Above the lift of coplanar surfaces (`renderer_vk/src/trace/lifted.rs`).
const float RAY_START = 0.02;

// Whether a point has no surface, so that light from each direction counts fully.
bool has_no_surface(BakePoint point) { return point.normal == vec3(0.0); }

// Cosine of the incidence of light.
float incidence(BakePoint point, vec3 direction) { return has_no_surface(point) ? 1.0 : max(dot(point.normal, direction), 0.0); }

// Number of a hit triangle among the map's.
uint triangle_number(Hit hit) {
    const uint64_t TRIANGLE_BYTES = 32ul;
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    return uint((record.triangles - BAKE.records) / TRIANGLE_BYTES) + hit.primitive;
}

// The sum so far.
BakeLight bake_begin(uint slot) {
    BakeLight sum = BakeLight(vec3(0.0), vec3(0.0));
    if (push.begins == 0) sum = BakeLights(push.results).at[slot];
    return sum;
}

void bake_add(inout BakeLight sum, vec3 light, vec3 direction) {
    sum.value += light;
    sum.towards += luminance(light) * direction;
}

// The row of lights of the cluster that contains a point; as `q3bsp::Bsp::cluster_at`.
uint bake_row(vec3 position) {
    uint none = BAKE.cluster_count, node_count = BAKE.node_count;
    BspNodes nodes = BspNodes(BAKE.nodes);
    int index = 0;
    for (uint i = 0; i < node_count && index >= 0; i++) {
        BspNode node = nodes.at[index];
        index = node.children[dot(node.plane.xyz, position) > node.plane.w ? 0 : 1];
    }
    if (node_count == 0 || index >= 0) return none;
    int cluster = Integers(BAKE.leaf_clusters).at[-1 - index];
    return cluster >= 0 && uint(cluster) < none ? uint(cluster) : none;
}

#endif
