// Draws a light by a random descent of a tree (Estevez and Kulla, Importance Sampling of Many Lights with Adaptive Tree
// Splitting, HPG 2018, section 5): at each node a child is chosen with a probability in proportion to an upper bound of
// the unshadowed light of its lights at the point. The probability of the light is the product.
#ifndef RELIGHT_TRACE_LIGHT_TREE_GLSL
#define RELIGHT_TRACE_LIGHT_TREE_GLSL

#include "trace/view.glsl"
#include "trace/random.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightTreeNodes { LightTreeNode at[]; };

// Added to cosines, so that rounding excludes no light.
const float COSINE_MARGIN = 1.0e-3;

// Cosine of the difference of two angles; 1 where the first is smaller.
float cos_of_rest(float cos_a, float cos_b, float sin_b) {
    if (cos_a >= cos_b) return 1.0;
    return cos_a * cos_b + sqrt(max(1.0 - cos_a * cos_a, 0.0)) * sin_b;
}

// Importance of a node: power times bounds of both cosines over the squared distance. The bounds are those of directions
// to the sphere around the node's box; inside of it both are 1. Zero only if none of the lights reaches the point.
float tree_importance(LightTreeNode node, vec3 position, vec3 normal) {
    vec3 to = node.centre - position;
    float squared = dot(to, to), reach = node.radius * node.radius;
    if (squared <= reach) return node.power / max(reach, 1.0e-6);
    float inverse = inversesqrt(max(squared, 1.0e-12));
    float sin_u = min(node.radius * inverse, 1.0), cos_u = sqrt(1.0 - sin_u * sin_u);
    float received = cos_of_rest(dot(normal, to) * inverse, cos_u, sin_u);
    float facing = -dot(node.axis, to) * inverse, emitted = 1.0;
    if (facing < node.cos_spread) {
        float sin_facing = sqrt(max(1.0 - facing * facing, 0.0)), sin_spread = sqrt(max(1.0 - node.cos_spread * node.cos_spread, 0.0));
        emitted = cos_of_rest(facing * node.cos_spread + sin_facing * sin_spread, cos_u, sin_u);
    }
    received = min(received + COSINE_MARGIN, 1.0);
    emitted = min(emitted + COSINE_MARGIN, 1.0);
    if (received <= 0.0 || emitted <= 0.0) return 0.0;
    return node.power * received * emitted / max(squared, 1.0e-6);
}

// Below this probability, `u` has lost the digits that further decisions need.
const float FEW_DIGITS = 1.0 / 1024.0;

// Draws a light from the tree of constant lights or that of lights which change; false: none reaches the point.
bool draw_from_tree(vec3 position, vec3 normal, float u, out uint light, out float chance) {
    light = 0;
    chance = 1.0;
    LightTreeNodes nodes = LightTreeNodes(VIEW.lights.tree), changing = LightTreeNodes(VIEW.lights.changing_tree);
    float first = VIEW.lights.tree_nodes > 0 ? tree_importance(nodes.at[0], position, normal) * VIEW.lights.scale : 0.0;
    float second = VIEW.lights.changing_tree_nodes > 0 ? tree_importance(changing.at[0], position, normal) : 0.0;
    uint bound = VIEW.lights.tree_nodes + VIEW.lights.changing_tree_nodes;
    float known = 1.0; // when `u` was last renewed
    // a tree is at most as deep as its number of nodes
    for (uint depth = 0, node = 0; depth <= bound; depth++) {
        float sum = first + second;
        if (!(sum > 0.0)) return false;
        float part = first / sum;
        if (chance < known * FEW_DIGITS) {
            u = rng_next();
            known = chance;
        }
        bool is_first = rng_decide(u, part);
        chance *= is_first ? part : 1.0 - part;
        if (depth > 0) node += is_first ? 0 : 1;
        else if (!is_first) nodes = changing;
        uint children = nodes.at[node].first;
        if (children == 0) {
            light = nodes.at[node].light;
            return chance > 0.0;
        }
        node = children;
        first = tree_importance(nodes.at[node], position, normal);
        second = tree_importance(nodes.at[node + 1], position, normal);
    }
    return false;
}

#endif
