// The compute tracer: two levels of bounding volume hierarchies, built on the CPU (`support/src/bvh.rs`,
// `renderer_vk/src/trace/bvh.rs`). With TRACER_GRID an instance may have a uniform grid in place of its hierarchy.
#ifndef RELIGHT_TRACE_BVH_GLSL
#define RELIGHT_TRACE_BVH_GLSL

#include "trace/candidate.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer BvhNodes { BvhNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer BvhTriangles { BvhTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer BvhInstances { BvhInstance at[]; };

// Kinds of traversal: nearest hit, any hit, translucent layers.
const uint BVH_CLOSEST = 0, BVH_ANY = 1, BVH_LAYER = 2;

// A ray in the space of an instance, prepared for box and triangle tests.
struct BvhRay {
    vec3 origin;
    vec3 inverse;  // of the direction
    uint axis;     // index of the direction's largest component
    vec3 shear;
};

vec3 bvh_permute(vec3 v, uint axis) { return axis == 0 ? v.yzx : (axis == 1 ? v.zxy : v); }

BvhRay bvh_ray(vec3 origin, vec3 direction) {
    BvhRay ray;
    ray.origin = origin;
    // replaces zeros: zero times infinity is not a number
    vec3 d = mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
    ray.inverse = 1.0 / d;
    vec3 m = abs(direction);
    ray.axis = m.x > m.y && m.x > m.z ? 0 : (m.y > m.z ? 1 : 2);
    vec3 p = bvh_permute(direction, ray.axis);
    ray.shear = vec3(p.x / p.z, p.y / p.z, 1.0 / p.z);
    return ray;
}

// The four bytes of a word, lowest first.
vec4 bvh_bytes(uint v) { return vec4(v & 255u, (v >> 8) & 255u, (v >> 16) & 255u, v >> 24); }

// Distances at which the ray enters the boxes of a node's children; `FAR_AWAY` for a miss. The far sides are widened by
// the rounding error of the test (Ize, Robust BVH Ray Traversal, JCGT 2013); the boxes include the rounding error of
// the node's grid.
const float FAR_AWAY = 3.0e38;
vec4 bvh_boxes(BvhRay ray, BvhNode node, float tmin, float tmax) {
    vec3 scale = node.step * ray.inverse, shift = (node.origin - ray.origin) * ray.inverse;
    bvec3 back = lessThan(ray.inverse, vec3(0.0));
    vec4 enter = bvh_bytes(back.x ? node.high[0] : node.low[0]) * scale.x + shift.x;
    vec4 leave = bvh_bytes(back.x ? node.low[0] : node.high[0]) * scale.x + shift.x;
    enter = max(enter, bvh_bytes(back.y ? node.high[1] : node.low[1]) * scale.y + shift.y);
    leave = min(leave, bvh_bytes(back.y ? node.low[1] : node.high[1]) * scale.y + shift.y);
    enter = max(enter, bvh_bytes(back.z ? node.high[2] : node.low[2]) * scale.z + shift.z);
    leave = min(leave, bvh_bytes(back.z ? node.low[2] : node.high[2]) * scale.z + shift.z);
    enter = max(enter, vec4(tmin));
    leave = min(leave * 1.000001, vec4(tmax));
    return mix(vec4(FAR_AWAY), enter, lessThanEqual(enter, leave));
}

// Watertight test (Woop, Benthin, Wald, JCGT 2013): t and the weights of the corners b and c; t is negative for a miss.
vec3 bvh_triangle(BvhRay ray, BvhTriangle triangle) {
    vec3 a = bvh_permute(triangle.a - ray.origin, ray.axis);
    vec3 b = bvh_permute(triangle.b - ray.origin, ray.axis);
    vec3 c = bvh_permute(triangle.c - ray.origin, ray.axis);
    precise vec2 pa = a.xy - ray.shear.xy * a.z;
    precise vec2 pb = b.xy - ray.shear.xy * b.z;
    precise vec2 pc = c.xy - ray.shear.xy * c.z;
    precise float u = pc.x * pb.y - pc.y * pb.x;
    precise float v = pa.x * pc.y - pa.y * pc.x;
    precise float w = pb.x * pa.y - pb.y * pa.x;
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return vec3(-1.0);
    float determinant = u + v + w;
    if (determinant == 0.0) return vec3(-1.0);
    float t = (u * a.z + v * b.z + w * c.z) * ray.shear.z;
    return vec3(t, v, w) / determinant;
}

// State of a traversal over all instances.
struct BvhWalk {
    uint mode;
    float tmin;
    float tmax;
    vec3 direction; // world space
    Hit hit;
    // found so far, in a traversal for layers
    LayerList layers;
    LayerOrder last;
};

// Records a hit; true ends the traversal.
bool bvh_report(inout BvhWalk walk, Hit hit) {
    if (walk.mode == BVH_LAYER) {
        layers_add(walk.layers, hit, walk.direction, walk.last);
        // no hit beyond this distance can have a smaller key than the last of the list
        float last = walk.layers.keys[LAYERS_A_RAY - 1];
        if (last < LAYER_NONE) walk.tmax = min(walk.tmax, last + 2.0 * layer_slack(last + layer_slack(last)));
        return false;
    }
    uint kind = Geometries(VIEW.scene.geometries).at[hit.geometry].kind;
    if ((kind == KIND_TESTED || kind == KIND_PASSED) && !is_stopped_by(hit, walk.direction)) return false;
    walk.hit = hit;
    walk.tmax = hit.t;
    return walk.mode == BVH_ANY;
}

// Puts the nearer of two children first.
void bvh_sort(inout float near_a, inout uint a, inout float near_b, inout uint b) {
    bool swap = near_b < near_a;
    float near = near_a;
    uint child = a;
    near_a = swap ? near_b : near_a;
    a = swap ? b : a;
    near_b = swap ? near : near_b;
    b = swap ? child : b;
}

// Value of `instance` while the top level is traversed.
const uint BVH_TOP = 0xFFFFFFFFu;

#ifdef TRACER_GRID
#include "trace/grid.glsl"
#endif

void bvh_walk(inout BvhWalk walk, vec3 origin, uint mask) {
    if (VIEW.scene.nodes == 0) return;
    BvhRay outside = bvh_ray(origin, walk.direction);
    BvhRay ray = outside;
    BvhNodes nodes = BvhNodes(VIEW.scene.nodes);
    BvhInstances instances = BvhInstances(VIEW.scene.placed);
    BvhTriangles triangles = BvhTriangles(uint64_t(0));
    uint geometry = 0;
    // postponed children with their entry distances; the number of them when the instance was entered
    uvec2 stack[2 * BVH_STACK];
    uint size = 0;
    uint base = BVH_TOP;
    uint current = 0;
    while (true) {
        // descends to a leaf, or until this level is finished
        while (current < BVH_LEAF) {
            BvhNode node = nodes.at[current];
            vec4 near = bvh_boxes(ray, node, walk.tmin, walk.tmax);
            uint c0 = node.children[0], c1 = node.children[1], c2 = node.children[2], c3 = node.children[3];
            float n0 = c0 == BVH_NONE ? FAR_AWAY : near.x, n1 = c1 == BVH_NONE ? FAR_AWAY : near.y;
            float n2 = c2 == BVH_NONE ? FAR_AWAY : near.z, n3 = c3 == BVH_NONE ? FAR_AWAY : near.w;
            bvh_sort(n0, c0, n1, c1);
            bvh_sort(n2, c2, n3, c3);
            bvh_sort(n0, c0, n2, c2);
            bvh_sort(n1, c1, n3, c3);
            bvh_sort(n1, c1, n2, c2);
            if (n3 < FAR_AWAY) stack[size++] = uvec2(c3, floatBitsToUint(n3));
            if (n2 < FAR_AWAY) stack[size++] = uvec2(c2, floatBitsToUint(n2));
            if (n1 < FAR_AWAY) stack[size++] = uvec2(c1, floatBitsToUint(n1));
            current = c0;
            if (n0 >= FAR_AWAY) {
                uint floor = base == BVH_TOP ? 0 : base;
                current = BVH_NONE;
                while (size > floor && current == BVH_NONE) {
                    uvec2 later = stack[--size];
                    if (uintBitsToFloat(later.y) <= walk.tmax) current = later.x;
                }
            }
        }
        if (current != BVH_NONE) {
            uint first = current & BVH_FIRST;
            if (base == BVH_TOP) {
                BvhInstance instance = instances.at[first];
                if ((instance.mask & mask) != 0) {
                    vec4 from = vec4(origin, 1.0);
                    vec3 d = walk.direction;
                    // not normalized, so that distances are those of the world
                    ray = bvh_ray(
                        vec3(dot(instance.to_object[0], from), dot(instance.to_object[1], from), dot(instance.to_object[2], from)),
                        vec3(dot(instance.to_object[0].xyz, d), dot(instance.to_object[1].xyz, d), dot(instance.to_object[2].xyz, d)));
#ifdef TRACER_GRID
                    if ((instance.mask & INSTANCE_GRID) != 0) {
                        if (grid_walk(walk, ray, instance)) return;
                        ray = outside;
                        current = BVH_NONE;
                        continue;
                    }
#endif
                    nodes = BvhNodes(instance.nodes);
                    triangles = BvhTriangles(instance.triangles);
                    geometry = instance.geometry;
                    base = size;
                    current = 0;
                    continue;
                }
            } else {
                uint end = first + ((current >> BVH_COUNT_SHIFT) & 7u);
                for (uint i = first; i <= end; i++) {
                    BvhTriangle triangle = triangles.at[i];
                    vec3 found = bvh_triangle(ray, triangle);
                    if (!(found.x >= walk.tmin && found.x <= walk.tmax)) continue;
                    if (bvh_report(walk, Hit(geometry + triangle.part, triangle.primitive, found.yz, found.x))) return;
                }
            }
        }
        if (size == base) {
            base = BVH_TOP;
            ray = outside;
            nodes = BvhNodes(VIEW.scene.nodes);
        }
        if (size == 0) return;
        uvec2 later = stack[--size];
        // skips children beyond the nearest hit found since
        current = uintBitsToFloat(later.y) <= walk.tmax ? later.x : BVH_NONE;
    }
}

// See `trace_ray`.
Hit follow_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    BvhWalk walk;
    walk.mode = any_hit ? BVH_ANY : BVH_CLOSEST;
    walk.tmin = tmin;
    walk.tmax = tmax;
    walk.direction = direction;
    walk.hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    bvh_walk(walk, origin, mask);
    return walk.hit;
}

// See `trace_layers`.
void follow_layers(vec3 origin, vec3 direction, float tmax, uint mask, LayerOrder order, out LayerList found) {
    BvhWalk walk;
    walk.mode = BVH_LAYER;
    walk.tmin = layer_start(order);
    walk.tmax = tmax;
    walk.direction = direction;
    walk.hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    layers_clear(walk.layers);
    walk.last = order;
    bvh_walk(walk, origin, mask);
    found = walk.layers;
}

#endif
