// Points around vertices of the map's triangles, and rays from them that meet the map alone.
#ifndef RELIGHT_TRACE_VERTEX_SURFACE_GLSL
#define RELIGHT_TRACE_VERTEX_SURFACE_GLSL

#include "trace/vertex_grid.glsl"
#include "trace/trace.glsl"

// A point on the side of a triangle that a vertex is for.
PathVertex surface_vertex(GridVertex g, vec2 barycentrics) {
    SurfacePoint p;
    p.triangle = Triangles(VIEW.vertex_light.triangles).at[g.triangle];
    p.instance = 0; // the world
    p.vertices = VIEW.vertex_light.vertices;
    p.weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    TraceVertices vertices = TraceVertices(p.vertices);
    p.position = vec3(0.0);
    p.normal = vec3(0.0);
    for (uint i = 0; i < 3; i++) {
        Vertex corner = vertices.at[p.triangle.indices[i]];
        p.position += corner.position * p.weights[i];
        p.normal += corner.normal * p.weights[i];
    }
    p.face_normal = safe_normalize(world_face(g.triangle), vec3(0.0, 0.0, 1.0));
    // the only side of some materials is the back
    bool back = g.back != ((material_of(p.triangle.material).flags & MATERIAL_CULL_BACK) != 0);
    vec3 face = back ? -p.face_normal : p.face_normal;
    vec3 normal = safe_normalize(p.normal, face);
    if (dot(normal, face) < 0.0) normal = -normal;
    return PathVertex(shading_position(p, face), face, normal, CHAIN_NONE, vec3(0.0), NO_GLOSS, vec3(0.0));
}

// Most surfaces of entities that a ray passes.
const uint MOST_PASSED = 16;

// The nearest hit of the world. Rays pass entities: what moves has no part in the light of vertices.
Hit trace_world(vec3 origin, vec3 direction, float limit) {
    float from = 0.0;
    Hit hit;
    for (uint i = 0; i < MOST_PASSED; i++) {
        hit = trace_ray(origin, from, direction, limit, MASK_SOLID | MASK_SKY, false);
        if (hit.geometry == NO_HIT || world_triangle(hit) < VIEW.vertex_light.world_count) return hit;
        from = hit.t + 0.01 + 1.0e-5 * hit.t;
        hit.geometry = NO_HIT;
    }
    return hit;
}

#endif
