// Order of translucent layers along a ray: a strict total order, so that each layer is hit exactly once.
#ifndef RELIGHT_TRACE_LAYER_ORDER_GLSL
#define RELIGHT_TRACE_LAYER_ORDER_GLSL

// Layers closer than this may share a plane (decals lie on their surfaces); units at distance zero.
const float LAYER_SLACK = 0.05;

float layer_slack(float t) { return LAYER_SLACK + 2.0e-5 * t; }

// Distance minus a bias: of coplanar layers, the one that the engine draws later is in front.
float layer_key(uint triangle_flags, float t) {
    float rank = float((triangle_flags >> TRIANGLE_RANK_SHIFT) & 255u) / 255.0;
    return t - rank * layer_slack(t);
}

// Whether layer a comes before layer b. At equal keys the greater index comes first: it is drawn later.
bool layer_before(float key_a, uint geometry_a, uint primitive_a, float key_b, uint geometry_b, uint primitive_b) {
    if (key_a != key_b) return key_a < key_b;
    if (geometry_a != geometry_b) return geometry_a > geometry_b;
    return primitive_a > primitive_b;
}

#endif
