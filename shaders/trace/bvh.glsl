// The compute tracer: two levels of binary bounding volume hierarchies, built on the CPU (renderer_vk/src/trace/bvh.rs).
#ifndef RELIGHT_TRACE_BVH_GLSL
#define RELIGHT_TRACE_BVH_GLSL

#include "trace/candidate.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BvhNodes { BvhNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BvhTriangles { BvhTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BvhInstances { BvhInstance at[]; };

// Deepest hierarchy that the builder makes.
const uint BVH_DEPTH = 48;

// What a walk looks for.
const uint BVH_CLOSEST = 0, BVH_ANY = 1, BVH_LAYER = 2;

// A ray in the space of an instance, prepared for boxes and triangles.
struct BvhRay {
    vec3 origin;
    vec3 inverse;  // of the direction
    uint axis;     // largest component of the direction
    vec3 shear;
};

vec3 bvh_permute(vec3 v, uint axis) { return axis == 0 ? v.yzx : (axis == 1 ? v.zxy : v); }

BvhRay bvh_ray(vec3 origin, vec3 direction) {
    BvhRay ray;
    ray.origin = origin;
    // no zero: zero times infinity is not a number
    vec3 d = mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
    ray.inverse = 1.0 / d;
    vec3 m = abs(direction);
    ray.axis = m.x > m.y && m.x > m.z ? 0 : (m.y > m.z ? 1 : 2);
    vec3 p = bvh_permute(direction, ray.axis);
    ray.shear = vec3(p.x / p.z, p.y / p.z, 1.0 / p.z);
    return ray;
}

// Distance at which the ray enters the box, or a negative number. The far side is widened by what rounding can cost
// (Ize, Robust BVH Ray Traversal, JCGT 2013).
float bvh_box(BvhRay ray, vec3 low, vec3 high, float tmin, float tmax) {
    vec3 a = (low - ray.origin) * ray.inverse, b = (high - ray.origin) * ray.inverse;
    vec3 near = min(a, b), far = max(a, b) * 1.0000004;
    float enter = max(max(near.x, near.y), max(near.z, tmin));
    float leave = min(min(far.x, far.y), min(far.z, tmax));
    return enter <= leave ? enter : -1.0;
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

// State of a walk over all instances.
struct BvhWalk {
    uint mode;
    float tmin;
    float tmax;
    vec3 direction; // world space
    Hit hit;
    float key;
    LayerOrder last;
};

// Takes note of a hit; true ends the walk.
bool bvh_report(inout BvhWalk walk, Hit hit, uint kind) {
    if (walk.mode == BVH_LAYER) {
        float key;
        LayerOrder best = LayerOrder(walk.key, walk.hit.geometry, walk.hit.primitive);
        if (is_next_layer(hit, walk.direction, walk.last, best, key)) {
            walk.hit = hit;
            walk.key = key;
            // nothing farther than this can have a smaller key
            walk.tmax = min(walk.tmax, key + 2.0 * layer_slack(hit.t));
        }
        return false;
    }
    if (kind == KIND_TESTED && !is_stopped_by(hit)) return false;
    walk.hit = hit;
    walk.tmax = hit.t;
    return walk.mode == BVH_ANY;
}

// Walks one instance; true ends the whole walk.
bool bvh_walk_instance(inout BvhWalk walk, BvhInstance instance, vec3 origin, vec3 direction) {
    vec4 from = vec4(origin, 1.0);
    vec3 o = vec3(dot(instance.to_object[0], from), dot(instance.to_object[1], from), dot(instance.to_object[2], from));
    // not normalized: distances stay those of the world
    vec3 d = vec3(dot(instance.to_object[0].xyz, direction), dot(instance.to_object[1].xyz, direction), dot(instance.to_object[2].xyz, direction));
    BvhRay ray = bvh_ray(o, d);
    BvhNodes nodes = BvhNodes(instance.nodes);
    BvhTriangles triangles = BvhTriangles(instance.triangles);
    uint stack[BVH_DEPTH];
    uint size = 0;
    uint index = 0;
    while (true) {
        BvhNode node = nodes.at[index];
        float t0 = bvh_box(ray, node.low[0], node.high[0], walk.tmin, walk.tmax);
        float t1 = bvh_box(ray, node.low[1], node.high[1], walk.tmin, walk.tmax);
        for (uint side = 0; side < 2; side++) {
            if ((side == 0 ? t0 : t1) < 0.0 || node.count[side] == 0) continue;
            for (uint i = 0; i < node.count[side]; i++) {
                BvhTriangle triangle = triangles.at[node.first[side] + i];
                vec3 found = bvh_triangle(ray, triangle);
                if (!(found.x >= walk.tmin && found.x <= walk.tmax)) continue;
                if (bvh_report(walk, Hit(instance.geometry, triangle.primitive, found.yz, found.x), instance.kind)) return true;
            }
        }
        bool go0 = t0 >= 0.0 && node.count[0] == 0, go1 = t1 >= 0.0 && node.count[1] == 0;
        if (go0 && go1) {
            bool swapped = t1 < t0;
            stack[size++] = node.first[swapped ? 0 : 1];
            index = node.first[swapped ? 1 : 0];
        } else if (go0) {
            index = node.first[0];
        } else if (go1) {
            index = node.first[1];
        } else if (size > 0) {
            index = stack[--size];
        } else {
            return false;
        }
    }
}

void bvh_walk(inout BvhWalk walk, vec3 origin, uint mask) {
    if (VIEW.bvh_nodes == 0) return;
    BvhRay ray = bvh_ray(origin, walk.direction);
    BvhNodes nodes = BvhNodes(VIEW.bvh_nodes);
    BvhInstances instances = BvhInstances(VIEW.bvh_instances);
    uint stack[BVH_DEPTH];
    uint size = 0;
    uint index = 0;
    while (true) {
        BvhNode node = nodes.at[index];
        float t0 = bvh_box(ray, node.low[0], node.high[0], walk.tmin, walk.tmax);
        float t1 = bvh_box(ray, node.low[1], node.high[1], walk.tmin, walk.tmax);
        for (uint side = 0; side < 2; side++) {
            if ((side == 0 ? t0 : t1) < 0.0) continue;
            for (uint i = 0; i < node.count[side]; i++) {
                BvhInstance instance = instances.at[node.first[side] + i];
                if ((instance.mask & mask) != 0 && bvh_walk_instance(walk, instance, origin, walk.direction)) return;
            }
        }
        bool go0 = t0 >= 0.0 && node.count[0] == 0, go1 = t1 >= 0.0 && node.count[1] == 0;
        if (go0 && go1) {
            bool swapped = t1 < t0;
            stack[size++] = node.first[swapped ? 0 : 1];
            index = node.first[swapped ? 1 : 0];
        } else if (go0) {
            index = node.first[0];
        } else if (go1) {
            index = node.first[1];
        } else if (size > 0) {
            index = stack[--size];
        } else {
            return;
        }
    }
}

// The nearest thing of the mask between tmin and tmax, translucent ones left out; with `any_hit` only whether there is
// one: `geometry` is NO_HIT if not, and nothing else of the answer counts.
Hit trace_ray(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    rays_asked++;
    BvhWalk walk;
    walk.mode = any_hit ? BVH_ANY : BVH_CLOSEST;
    walk.tmin = tmin;
    walk.tmax = tmax;
    walk.direction = direction;
    walk.hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    bvh_walk(walk, origin, mask);
    return walk.hit;
}

// The next translucent layer behind `order` and before tmax; moves `order` to it. Layers in one plane come in the
// order of the engine, what it draws last first.
Hit trace_layer(vec3 origin, vec3 direction, float tmax, uint mask, inout LayerOrder order) {
    rays_asked++;
    BvhWalk walk;
    walk.mode = BVH_LAYER;
    walk.tmin = layer_start(order);
    walk.tmax = tmax;
    walk.direction = direction;
    walk.hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    walk.key = LAYER_NONE;
    walk.last = order;
    bvh_walk(walk, origin, mask);
    if (walk.hit.geometry != NO_HIT) order = LayerOrder(walk.key, walk.hit.geometry, walk.hit.primitive);
    return walk.hit;
}

#endif
