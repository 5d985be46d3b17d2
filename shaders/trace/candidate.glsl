// Decisions about triangles that a ray may pass (cut-outs, translucent layers), shared by all tracers.
#ifndef RELIGHT_TRACE_CANDIDATE_GLSL
#define RELIGHT_TRACE_CANDIDATE_GLSL

#include "trace/layer.glsl"
#include "trace/layer_order.glsl"

// Position of a translucent layer in the order along a ray, nearest first.
struct LayerOrder {
    float key;
    uint geometry;
    uint primitive;
};

// Key of an empty entry.
const float LAYER_NONE = 1.0e30;

LayerOrder layer_begin() { return LayerOrder(-LAYER_NONE, NO_HIT, NO_HIT); }

// Layers that one ray finds. With 1, a pixel behind n layers needs n + 1 rays; more layers occupy more registers while
// a layer is shaded.
const uint LAYERS_A_RAY = 2;

// The nearest layers of a ray behind a given layer, in order; unused entries have no geometry.
struct LayerList {
    float keys[LAYERS_A_RAY];
    Hit hits[LAYERS_A_RAY];
};

// Empties the list. Only the keys are valid then.
void layers_clear(out LayerList list) {
    for (uint i = 0; i < LAYERS_A_RAY; i++) {
        list.keys[i] = LAYER_NONE;
        list.hits[i].geometry = NO_HIT;
        list.hits[i].primitive = NO_HIT;
    }
}

// Adds a hit if it is a translucent layer that is not culled, lies behind `last`, and is among the nearest so far.
void layers_add(inout LayerList list, Hit hit, vec3 direction, LayerOrder last) {
    // order before facing: of many layers on a ray, each is a candidate again for every later list
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    float key = layer_key(Triangles(record.triangles).at[hit.primitive].flags, hit.t);
    if (!layer_before(last.key, last.geometry, last.primitive, key, hit.geometry, hit.primitive)) return;
    const int end = int(LAYERS_A_RAY) - 1;
    if (!layer_before(key, hit.geometry, hit.primitive, list.keys[end], list.hits[end].geometry, list.hits[end].primitive)) return;
    if (is_culled(surface_point(hit), direction)) return;
    for (int i = end; i >= 0; i--) {
        if (!layer_before(key, hit.geometry, hit.primitive, list.keys[i], list.hits[i].geometry, list.hits[i].primitive)) break;
        if (i < end) {
            list.keys[i + 1] = list.keys[i];
            list.hits[i + 1] = list.hits[i];
        }
        list.keys[i] = key;
        list.hits[i] = hit;
    }
}

// Removes the nearest layer from the list; `order` becomes its position. NO_HIT: the list is empty.
Hit layers_take(inout LayerList list, inout LayerOrder order) {
    Hit hit = list.hits[0];
    if (hit.geometry != NO_HIT) order = LayerOrder(list.keys[0], hit.geometry, hit.primitive);
    for (uint i = 1; i < LAYERS_A_RAY; i++) {
        list.keys[i - 1] = list.keys[i];
        list.hits[i - 1] = list.hits[i];
    }
    return hit;
}

// Least distance of layers behind `last`: a layer lies at its key or up to a bias behind it.
float layer_start(LayerOrder last) { return max(last.key - 0.01, 0.0); }

// 1: rays of scattered light may meet cut-outs without a test of their alpha (`rt_cutouts`).
layout(constant_id = 13) const uint CUT_OUTS = 0;

// How the current ray meets cut-outs: CUT_OUTS_*. CUT_OUTS_SKIPPED takes those of known coverage as solid; or
// CUT_OUTS_OPEN: it passes these.
uint ray_cut_outs = CUT_OUTS_TESTED;
const uint CUT_OUTS_OPEN = 4;

// The cut-out that a triangle is part of; coverage 0: it is none of the map's, or its coverage is unknown.
CutOut cut_out_of(Triangle triangle) {
    if ((triangle.flags & (TRIANGLE_STATIC | TRIANGLE_ONE_SIDED)) != TRIANGLE_STATIC || VIEW.transport.cut_outs == 0) return CutOut(vec3(0.0), 0.0, vec3(0.0));
    return CutOuts(VIEW.transport.cut_outs).at[triangle.instance];
}

// Squares of the mask for one repetition of the texture coordinates, along each axis.
const float MASK_SQUARES = 8.0;

// A mask in place of the image: each square has a square hole in its middle, of its area times 1 - coverage (an
// inexpensive mask for rays of bounces: Deferred Hybrid Path Tracing, section 26.3.3; the pattern is ours).
bool mask_is_solid(vec2 st, float coverage) {
    vec2 place = abs(2.0 * fract(st * MASK_SQUARES) - 1.0);
    return max(place.x, place.y) >= sqrt(1.0 - coverage);
}

// Whether the ray needs no alpha test at a hit; `stopped`: it ends there.
bool meets_untested(Hit hit, out bool stopped) {
    stopped = true;
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    Triangle triangle = Triangles(record.triangles).at[hit.primitive];
    if ((triangle.flags & TRIANGLE_ONE_SIDED) != 0) return false;
    if (ray_cut_outs == CUT_OUTS_SOLID) return true;
    float coverage = cut_out_of(triangle).coverage;
    if (coverage <= 0.0) return false;
    stopped = ray_cut_outs == CUT_OUTS_SKIPPED;
    if (ray_cut_outs == CUT_OUTS_MASKED) {
        TraceVertices vertices = TraceVertices(record.vertices);
        vec2 a = vertices.at[triangle.indices[0]].st, b = vertices.at[triangle.indices[1]].st, c = vertices.at[triangle.indices[2]].st;
        stopped = mask_is_solid(a + (b - a) * hit.barycentrics.x + (c - a) * hit.barycentrics.y, coverage);
    }
    return true;
}

// Whether a triangle with holes, or one with an opposite in its plane, stops the ray at the hit.
bool is_stopped_by(Hit hit, vec3 direction) {
    bool stopped;
    if (CUT_OUTS != 0 && ray_cut_outs != CUT_OUTS_TESTED && meets_untested(hit, stopped)) return stopped;
    SurfacePoint p = surface_point(hit);
    if ((p.triangle.flags & TRIANGLE_ONE_SIDED) != 0) return !is_culled(p, direction);
    return is_solid_at(p, hit.t * VIEW.camera.pixel_spread);
}

#endif
