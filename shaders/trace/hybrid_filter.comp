#version 460
// Mean of the occlusion over a block of 4 x 4 texels, which has each direction of `hybrid_shadows.rgen` once. A second step does
// the same, which makes a tent of 7 x 7 texels: blocks of one mean would be visible. Texels of another plane are left out.
#define HYBRID_STEP
#include "trace/hybrid.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Greatest distance from the plane, relative to the depth, and least cosine between normals.
const float SAME_PLANE = 0.005, SAME_NORMAL = 0.9;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (hybrid_outside(texel)) return;
    bool first = push.number == 0;
    HybridTexels source = HybridTexels(first ? HYBRID_VIEW.texels : HYBRID_VIEW.between);
    HybridTexels target = HybridTexels(first ? HYBRID_VIEW.between : HYBRID_VIEW.texels);
    // the blocks of both steps lie on different sides of the texel
    ivec2 corner = texel - (first ? 1 : 2);
    HybridTexel own = source.at[hybrid_place(texel)];
    if (own.inverse_depth > 0.0) {
        vec3 position = hybrid_position(texel, own.inverse_depth);
        vec3 normal = unpack_normal(own.normal);
        float tolerance = hybrid_slack(own.inverse_depth) + SAME_PLANE / own.inverse_depth;
        float sum = 0.0, count = 0.0;
        for (int y = 0; y < 4; y++) {
            for (int x = 0; x < 4; x++) {
                ivec2 place = corner + ivec2(x, y);
                if (hybrid_outside(place)) continue;
                HybridTexel other = source.at[hybrid_place(place)];
                if (other.inverse_depth <= 0.0) continue;
                vec3 delta = hybrid_position(place, other.inverse_depth) - position;
                if (abs(dot(delta, normal)) > tolerance || dot(unpack_normal(other.normal), normal) < SAME_NORMAL) continue;
                sum += other.occlusion;
                count += 1.0;
            }
        }
        own.occlusion = sum / count;
    }
    target.at[hybrid_place(texel)] = own;
}
