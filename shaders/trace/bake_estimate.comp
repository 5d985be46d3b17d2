#version 460
// Finds for each point the sum of the unshadowed light of its list, and below which size lights are negligible.
#define BAKE_STEP
#include "trace/bake_sources.glsl"

layout(local_size_x = 32) in;

// Part of a point's unshadowed light that the weakest lights may have together and be left out; and absolute, a quarter of a
// step of a stored byte, irradiance over pi.
const float NEGLIGIBLE = 0.003;
const float NEGLIGIBLE_STEP = 0.25 * 4.0 / 255.0;

// Classes of lights by the power of two of their size: the weakest, and number.
const int WEAKEST = -24;
const int CLASSES = 24;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.count) return;
    BakePoint point = BakePoints(push.points).at[slot];
    List list = list_at(point.position);
    float classes[CLASSES];
    for (int i = 0; i < CLASSES; i++) classes[i] = 0.0;
    float whole = 0.0;
    uint first = list.suns + list.directions;
    for (uint i = 0; i < list.count; i++) {
        uint key;
        float size = size_of(see(first + i, list, point, key));
        if (!(size > 0.0)) continue;
        whole += size;
        // the exponent of a float is the power of two below it
        int power = int(floatBitsToUint(size) >> 23) - 127;
        classes[clamp(power - WEAKEST, 0, CLASSES - 1)] += size;
    }
    float left = min(whole * NEGLIGIBLE, NEGLIGIBLE_STEP), least = 0.0;
    for (int i = 0; i + 1 < CLASSES; i++) {
        left -= classes[i];
        if (left < 0.0) break;
        least = exp2(float(WEAKEST + i + 1));
    }
    BakeEstimates(push.estimates).at[slot] = BakeEstimate(max(whole, 1.0e-30), least);
}
