// The walk through a uniform grid over the triangles of an instance, cell by cell (Amanatides and Woo, A Fast Voxel
// Traversal Algorithm for Ray Tracing, Eurographics 1987). The grids are built on the CPU (`support/src/grid.rs`,
// `renderer_vk/src/trace/grid.rs`); triangles and candidates are tested as in a hierarchy.
#ifndef RELIGHT_TRACE_GRID_GLSL
#define RELIGHT_TRACE_GRID_GLSL

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Grids { GridRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer GridNumbers { uint at[]; };

// Tests the triangles of the cells on the ray, until the nearest hit lies before the next cell; true ends the traversal.
// A ray may test a triangle of several cells more than once, which changes nothing: masks keep rays that collect layers
// from grids.
bool grid_walk(inout BvhWalk walk, BvhRay ray, BvhInstance instance) {
    GridRecord grid = Grids(instance.nodes).at[0];
    GridNumbers starts = GridNumbers(grid.starts), entries = GridNumbers(grid.entries);
    BvhTriangles triangles = BvhTriangles(instance.triangles);
    ivec3 counts = ivec3(grid.counts[0], grid.counts[1], grid.counts[2]);
    // The ray passes boundary i of an axis at base + i * delta. Sums of delta would add up their rounding errors.
    vec3 base = (grid.origin - ray.origin) * ray.inverse, delta = grid.edge * ray.inverse;
    vec3 end = base + vec3(counts) * delta;
    vec3 near = min(base, end), far = max(base, end);
    float enter = max(max(near.x, near.y), max(near.z, walk.tmin));
    float leave = min(min(far.x, far.y), min(far.z, walk.tmax));
    if (!(enter <= leave)) return false;
    ivec3 cell = ivec3(floor((ray.origin + enter / ray.inverse - grid.origin) / grid.edge));
    cell = clamp(cell, ivec3(0), counts - 1);
    bvec3 back = lessThan(ray.inverse, vec3(0.0));
    ivec3 forth = mix(ivec3(1), ivec3(-1), back), ahead = mix(ivec3(1), ivec3(0), back);
    // each step moves a coordinate of the cell to a new value, so that the loop ends for rays that are not finite, too
    while (true) {
        uint place = uint((cell.z * counts.y + cell.y) * counts.x + cell.x);
        uint first = starts.at[place], last = starts.at[place + 1];
        for (uint i = first; i < last; i++) {
            BvhTriangle triangle = triangles.at[entries.at[i]];
            vec3 found = bvh_triangle(ray, triangle);
            if (!(found.x >= walk.tmin && found.x <= walk.tmax)) continue;
            if (bvh_report(walk, Hit(instance.geometry + triangle.part, triangle.primitive, found.yz, found.x))) return true;
        }
        vec3 next = base + vec3(cell + ahead) * delta;
        float least = min(next.x, min(next.y, next.z));
        if (walk.tmax <= least) return false;
        int axis = next.x == least ? 0 : (next.y == least ? 1 : 2);
        cell += mix(ivec3(0), forth, equal(ivec3(0, 1, 2), ivec3(axis)));
        if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, counts))) return false;
    }
    return false;
}

#endif
