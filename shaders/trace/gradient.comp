#version 460
// Spreads the gradients of the strata's samples (`gradient_sample.comp`) by three edge-avoiding a-trous steps in shared
// memory (Schied et al. 2018, section 4.3). Change and size of the light are filtered separately; `gradient_wide.comp`
// divides them.
#include "trace/denoise.glsl"

// Steps of 1, 2 and 3 strata reach 6 strata. 16 KiB is the shared memory that every device has.
const int ACROSS = 16, DOWN = 8, BORDER = 6, WIDE = ACROSS + 2 * BORDER, HIGH = DOWN + 2 * BORDER;
layout(local_size_x = ACROSS, local_size_y = DOWN) in;

// change and size of direct light, of indirect light, as 16-bit floats; each step reads one array and writes the other
shared uvec2 tiles[2][WIDE * HIGH];
shared uint guides[WIDE * HIGH];
// logarithms of the last frame's filtered luminance, direct and indirect, as 16-bit floats. They keep unchanged bright
// light from hiding a change of dim light beside it
shared uint levels[WIDE * HIGH];
// logarithms of inverse depths
shared float depths[WIDE * HIGH];

uvec2 filtered(uint source, ivec2 at, int spacing) {
    int place = at.y * WIDE + at.x;
    vec3 normal = guide_normal(guides[place]);
    // constant part of the dot product with a guide's normal, whose components are scaled by 15 and biased by 16
    float turned = -16.0 / 15.0 * (normal.x + normal.y + normal.z);
    float depth = depths[place], depth_scale = -8.0 / float(spacing);
    // a stratum without a sample accepts all neighbours
    uint packed = levels[place];
    vec2 own = unpackHalf2x16(packed);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 9; i++) {
        ivec2 offset = ivec2(i % 3, i / 3) - 1;
        int tap = place + (offset.y * WIDE + offset.x) * spacing;
        float kernel = (offset.x == 0 ? 1.0 : 0.0) + (offset.y == 0 ? 1.0 : 0.0);
        // tolerant of slanted surfaces: a gradient that leaks costs noise, not light
        vec2 alike = vec2(kernel + depth_scale * abs(depth - depths[tap]));
        uint level = levels[tap];
        if (packed != 0 && level != 0) alike -= abs(own - unpackHalf2x16(level));
        float cosine = dot(normal, guide_components(guides[tap]) - COMPONENT_ZERO) * (1.0 / 15.0) + turned;
        vec2 weight = exp2(alike) * max(cosine, 0.0);
        uvec2 gradient = tiles[source][tap];
        sum += weight.xxyy * vec4(unpackHalf2x16(gradient.x), unpackHalf2x16(gradient.y));
    }
    // the scale cancels in the ratio of change and size; this one preserves the range of the input
    sum *= 1.0 / 16.0;
    return uvec2(packHalf2x16(sum.xy), packHalf2x16(sum.zw));
}

void main() {
    ivec2 strata = (ivec2(VIEW.width, VIEW.height) + STRATUM - 1) / STRATUM;
    ivec2 corner = ivec2(gl_WorkGroupID.xy) * ivec2(ACROSS, DOWN) - BORDER;
    int index = int(gl_LocalInvocationIndex);
    for (int i = index; i < WIDE * HIGH; i += ACROSS * DOWN) {
        ivec2 stratum = corner + ivec2(i % WIDE, i / WIDE);
        bool there = all(greaterThanEqual(stratum, ivec2(0))) && all(lessThan(stratum, strata));
        uvec4 own = there ? LightTexels(DENOISE.gradient_samples).at[stratum_place(stratum)] : uvec4(0);
        tiles[0][i] = own.xy;
        levels[i] = own.z;
        guides[i] = own.w;
        depths[i] = log2(max(guide_inverse(own.w), 1.0e-6)); // 0: no surface
    }
    barrier();
    int border = 0;
    for (int spacing = 1; spacing <= 3; spacing++) {
        border += spacing;
        ivec2 inner = ivec2(WIDE, HIGH) - 2 * border;
        uint source = (spacing & 1) ^ 1;
        for (int i = index; i < inner.x * inner.y; i += ACROSS * DOWN) {
            ivec2 at = ivec2(i % inner.x, i / inner.x) + border;
            int place = at.y * WIDE + at.x;
            tiles[source ^ 1][place] = guides[place] != 0 ? filtered(source, at, spacing) : uvec2(0);
        }
        barrier();
    }
    ivec2 stratum = corner + BORDER + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(stratum, strata))) return;
    uvec2 sums = tiles[1][(int(gl_LocalInvocationID.y) + BORDER) * WIDE + int(gl_LocalInvocationID.x) + BORDER];
    GradientSums(DENOISE.gradient_sums).at[stratum_place(stratum)] = sums;
}
