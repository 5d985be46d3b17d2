#version 460
// The gradients of the strata's samples (gradient_sample.comp), spread over the neighbourhood by three edge-avoiding
// a-trous steps in shared memory (Schied et al. 2018, section 4.3: the change and the size of the light are filtered
// apart, and divided at the end, which gradient_wide.comp does).
#include "trace/denoise.glsl"

const int TILE = 16, BORDER = 7, WIDE = TILE + 2 * BORDER; // steps of 1, 2 and 4 strata reach 7 far
layout(local_size_x = TILE, local_size_y = TILE) in;

// change and size of direct light, of indirect light, as halfs
shared uvec2 tile[WIDE * WIDE];
shared uint guides[WIDE * WIDE];
// logarithms of the luminance that the last frame was left with, of both, as halfs: bright light that has not changed
// must not hide that dim light beside it has
shared uint levels[WIDE * WIDE];

uvec2 filtered(ivec2 at, int spacing) {
    uint guide = guides[at.y * WIDE + at.x];
    vec3 normal = guide_normal(guide);
    uint own = levels[at.y * WIDE + at.x];
    vec4 sum = vec4(0.0);
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            int tap = (at.y + y * spacing) * WIDE + at.x + x * spacing;
            uint other = guides[tap];
            if (other == 0) continue;
            float weight = (x == 0 ? 2.0 : 1.0) * (y == 0 ? 2.0 : 1.0);
            // wide for slanted surfaces: a gradient that leaks costs noise, not light
            weight *= exp2(-8.0 * abs(depth_change(guide, other)) / float(spacing)) * max(dot(normal, guide_normal(other)), 0.0);
            vec2 weights = vec2(weight);
            // a stratum without a sample takes from all around
            if (own != 0 && levels[tap] != 0) weights *= exp2(-abs(unpackHalf2x16(own) - unpackHalf2x16(levels[tap])));
            sum += weights.xxyy * vec4(unpackHalf2x16(tile[tap].x), unpackHalf2x16(tile[tap].y));
        }
    }
    // the scale is the same for change and size and falls out at the end; this one keeps it near that of the input
    sum *= 1.0 / 16.0;
    return uvec2(packHalf2x16(sum.xy), packHalf2x16(sum.zw));
}

void main() {
    ivec2 strata = (ivec2(VIEW.width, VIEW.height) + STRATUM - 1) / STRATUM;
    ivec2 corner = ivec2(gl_WorkGroupID.xy) * TILE - BORDER;
    int index = int(gl_LocalInvocationIndex);
    for (int i = index; i < WIDE * WIDE; i += TILE * TILE) {
        ivec2 stratum = corner + ivec2(i % WIDE, i / WIDE);
        bool there = all(greaterThanEqual(stratum, ivec2(0))) && all(lessThan(stratum, strata));
        uvec4 own = there ? imageLoad(uimages_rgba32ui[DENOISE.gradient_samples], stratum) : uvec4(0);
        tile[i] = own.xy;
        levels[i] = own.z;
        guides[i] = own.w;
    }
    int border = 0;
    for (int spacing = 1; spacing <= 4; spacing *= 2) {
        barrier();
        border += spacing;
        int edge = WIDE - 2 * border;
        // all are read before any is written
        uvec2 results[(WIDE * WIDE + TILE * TILE - 1) / (TILE * TILE)];
        int count = 0;
        for (int i = index; i < edge * edge; i += TILE * TILE) {
            ivec2 at = ivec2(i % edge, i / edge) + border;
            results[count++] = guides[at.y * WIDE + at.x] != 0 ? filtered(at, spacing) : uvec2(0);
        }
        barrier();
        count = 0;
        for (int i = index; i < edge * edge; i += TILE * TILE) {
            ivec2 at = ivec2(i % edge, i / edge) + border;
            tile[at.y * WIDE + at.x] = results[count++];
        }
    }
    barrier();
    ivec2 stratum = corner + BORDER + ivec2(gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(stratum, strata))) return;
    int place = (int(gl_LocalInvocationID.y) + BORDER) * WIDE + int(gl_LocalInvocationID.x) + BORDER;
    imageStore(images_rgba16f[DENOISE.gradient_sums], stratum, vec4(unpackHalf2x16(tile[place].x), unpackHalf2x16(tile[place].y)));
}
