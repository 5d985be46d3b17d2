// First hits found by the rasterizer (`rt_firstHits`): the hit of a pixel's ray on a triangle that is known.
#ifndef RELIGHT_TRACE_FIRST_HITS_GLSL
#define RELIGHT_TRACE_FIRST_HITS_GLSL

#define FIRST_HITS_STEP
#include "trace/geometry.glsl"

// Corners of a triangle relative to the eye, where the acceleration structures have them.
mat3 drawn_corners(GeometryRecord record, uint primitive) {
    Triangle triangle = Triangles(record.triangles).at[primitive];
    Instance instance = instance_of(record.instance != NO_INSTANCE ? record.instance : triangle.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
    vec3 from = instance.origin - VIEW.camera.origin;
    bool of_map = record.vertices == push.map_vertices;
    mat3 corners;
    for (int i = 0; i < 3; i++) {
        uint index = triangle.indices[i];
        vec3 position;
        if (of_map) position = Positions(push.positions).at[index];
        else position = TraceVertices(record.vertices).at[index].position;
        corners[i] = axis * position + from;
    }
    return corners;
}

// Where the ray from the eye meets the plane of the triangle. A sample at an edge may lie outside of the triangle by the
// rasterizer's rounding: then the nearest barycentrics inside.
Hit hit_of_triangle(uint geometry, uint primitive, vec3 direction) {
    mat3 corners = drawn_corners(Geometries(VIEW.scene.geometries).at[geometry], primitive);
    vec3 volumes = vec3(
        dot(direction, cross(corners[1], corners[2])),
        dot(direction, cross(corners[2], corners[0])),
        dot(direction, cross(corners[0], corners[1])));
    float sum = volumes.x + volumes.y + volumes.z;
    vec3 weights = sum != 0.0 ? max(volumes / sum, 0.0) : vec3(1.0);
    weights /= weights.x + weights.y + weights.z;
    return Hit(geometry, primitive, weights.yz, dot(corners * weights, direction));
}

#endif
