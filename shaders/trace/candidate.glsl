// What each tracer decides about a triangle that a ray meets and that may be passed: the same here for all of them.
#ifndef RELIGHT_TRACE_CANDIDATE_GLSL
#define RELIGHT_TRACE_CANDIDATE_GLSL

#include "trace/layer.glsl"
#include "trace/layer_order.glsl"

// The place of a translucent layer in the order along a ray, nearest first.
struct LayerOrder {
    float key;
    uint geometry;
    uint primitive;
};

// The key of no layer at all.
const float LAYER_NONE = 1.0e30;

LayerOrder layer_begin() { return LayerOrder(-LAYER_NONE, NO_HIT, NO_HIT); }

// A search for the next translucent layer: it lies behind `last`, and before `best` (key LAYER_NONE: none yet).
// Returns whether the hit is a better one, with its key.
bool is_next_layer(Hit hit, vec3 direction, LayerOrder last, LayerOrder best, out float key) {
    // the order first: of many layers on a ray, each is looked at for every other one
    GeometryRecord record = Geometries(VIEW.geometries).at[hit.geometry];
    key = layer_key(Triangles(record.triangles).at[hit.primitive].flags, hit.t);
    if (!layer_before(last.key, last.geometry, last.primitive, key, hit.geometry, hit.primitive)) return false;
    if (best.key < LAYER_NONE && !layer_before(key, hit.geometry, hit.primitive, best.key, best.geometry, best.primitive)) return false;
    return !is_culled(surface_point(hit), direction);
}

// From where on layers behind `last` are found: a layer lies at its key or a bias behind it.
float layer_start(LayerOrder last) { return max(last.key - 0.01, 0.0); }

// Whether a triangle with holes stops the ray where it meets it.
bool is_stopped_by(Hit hit) { return is_solid_at(surface_point(hit), hit.t * VIEW.pixel_spread); }

#endif
