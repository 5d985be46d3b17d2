#version 460
// Last step of the gradient's filter: 5 x 5 taps, six strata apart. Light from rare paths changes in few samples, and a
// neighbourhood without any of them shows no change. A stratum whose own neighbourhood changes more keeps its value.
#include "trace/denoise.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const int SPACING = 6;

vec4 sums_at(ivec2 stratum) {
    uvec2 sums = GradientSums(DENOISE.gradient_sums).at[stratum_place(stratum)];
    return vec4(unpackHalf2x16(sums.x), unpackHalf2x16(sums.y));
}

vec2 part_of(vec4 sums) {
    vec2 size = sums.yw;
    return min(mix(vec2(0.0), abs(sums.xz) / max(size, 1.0e-6), greaterThan(size, vec2(1.0e-6))), 1.0);
}

void main() {
    ivec2 stratum = ivec2(gl_GlobalInvocationID.xy);
    ivec2 strata = (ivec2(VIEW.width, VIEW.height) + STRATUM - 1) / STRATUM;
    if (any(greaterThanEqual(stratum, strata))) return;
    uint guide = imageLoad(uimages_r32ui[DENOISE.stratum_guide], stratum).x;
    vec4 own = sums_at(stratum);
    vec2 part = part_of(own);
    if (guide != 0) {
        vec3 normal = guide_normal(guide);
        const float kernel[3] = float[](6.0, 4.0, 1.0);
        vec4 sum = own * 36.0;
        for (int y = -2; y <= 2; y++) {
            for (int x = -2; x <= 2; x++) {
                ivec2 tap = stratum + ivec2(x, y) * SPACING;
                if ((x == 0 && y == 0) || any(lessThan(tap, ivec2(0))) || any(greaterThanEqual(tap, strata))) continue;
                uint other = imageLoad(uimages_r32ui[DENOISE.stratum_guide], tap).x;
                if (other == 0) continue;
                vec4 sums = sums_at(tap);
                float weight = kernel[abs(x)] * kernel[abs(y)] * max(dot(normal, guide_normal(other)), 0.0)
                    * exp2(-abs(depth_change(guide, other)));
                // as in the previous steps: much brighter light is unrelated
                vec2 alike = exp2(-abs(log2((sums.yw + 1.0e-5) / (own.yw + 1.0e-5))));
                sum += sums * (weight * alike).xxyy;
            }
        }
        part = max(part, part_of(sum));
    }
    imageStore(images_rg16f[DENOISE.gradient], stratum, vec4(part, 0.0, 0.0));
}
