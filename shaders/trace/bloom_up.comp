#version 460
// The spread light: the mean of the bloom's levels, each smoothed.
#include "trace/bloom.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Uniform cubic B-spline weights of four texels; `t`: position between the second and the third.
vec4 spline(float t) {
    float u = 1.0 - t;
    return vec4(u * u * u, 4.0 + t * t * (3.0 * t - 6.0), 4.0 + u * u * (3.0 * u - 6.0), t * t * t) / 6.0;
}

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    ivec2 target = bloom_size(0);
    if (place.x >= target.x || place.y >= target.y) return;
    vec3 sum = vec3(0.0);
    uint start = 0;
    for (uint level = 0; level < BLOOM_LEVELS; level++) {
        ivec2 size = bloom_size(level);
        vec2 at = (vec2(place) + 0.5) / float(1 << level) - 0.5;
        ivec2 second = ivec2(floor(at));
        vec4 across = spline(at.x - float(second.x)), down = spline(at.y - float(second.y));
        for (int y = 0; y < 4; y++)
            for (int x = 0; x < 4; x++)
                sum += across[x] * down[y] * bloom_read(start, size, second + ivec2(x - 1, y - 1));
        start += uint(size.x * size.y);
    }
    BloomTexels(VIEW.post.bloom).at[start + uint(place.y * target.x + place.x)] = bloom_pack(sum / float(BLOOM_LEVELS));
}
