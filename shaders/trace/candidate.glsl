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

// Layers that one ray finds. With one a ray, each pixel behind layers needs a ray for each of them and one more to know
// that there is none left; more are more to keep in registers while a layer is shaded.
const uint LAYERS_A_RAY = 2;

// The nearest layers of a ray behind a place in the order, in order; where there are fewer the others have no geometry.
struct LayerList {
    float keys[LAYERS_A_RAY];
    Hit hits[LAYERS_A_RAY];
};

// A list of none; its keys tell, and what else is in it counts for nothing.
void layers_clear(out LayerList list) {
    for (uint i = 0; i < LAYERS_A_RAY; i++) {
        list.keys[i] = LAYER_NONE;
        list.hits[i].geometry = NO_HIT;
        list.hits[i].primitive = NO_HIT;
    }
}

// Adds a hit to the list, if it is a translucent layer that shows its face, lies behind `last`, and is among the nearest so far.
void layers_add(inout LayerList list, Hit hit, vec3 direction, LayerOrder last) {
    // the order first: of many layers on a ray, each is looked at for every other list
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

// Takes the nearest layer out of the list; `order` becomes its place. No geometry: the list is empty.
Hit layers_take(inout LayerList list, inout LayerOrder order) {
    Hit hit = list.hits[0];
    if (hit.geometry != NO_HIT) order = LayerOrder(list.keys[0], hit.geometry, hit.primitive);
    for (uint i = 1; i < LAYERS_A_RAY; i++) {
        list.keys[i - 1] = list.keys[i];
        list.hits[i - 1] = list.hits[i];
    }
    return hit;
}

// From where on layers behind `last` are found: a layer lies at its key or a bias behind it.
float layer_start(LayerOrder last) { return max(last.key - 0.01, 0.0); }

// Whether a triangle with holes, or with an opposite in its plane, stops the ray where it meets it.
bool is_stopped_by(Hit hit, vec3 direction) {
    SurfacePoint p = surface_point(hit);
    if ((p.triangle.flags & TRIANGLE_ONE_SIDED) != 0) return !is_culled(p, direction);
    return is_solid_at(p, hit.t * VIEW.camera.pixel_spread);
}

#endif
