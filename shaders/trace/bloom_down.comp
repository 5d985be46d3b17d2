#version 460
// All levels of the bloom in one dispatch: a work group averages 64 x 64 pixels down to one texel of the last level.
#include "trace/bloom.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

// Mean light of a texel; w: number of pixels that it covers.
shared vec4 texels[16 * 16];

void main() {
    ivec2 picture = picture_size();
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    uint local = gl_LocalInvocationIndex;
    vec3 sum = vec3(0.0);
    float count = 0.0;
    for (int y = 0; y < int(BLOOM_FIRST); y++) {
        for (int x = 0; x < int(BLOOM_FIRST); x++) {
            ivec2 pixel = place * int(BLOOM_FIRST) + ivec2(x, y);
            if (pixel.x >= picture.x || pixel.y >= picture.y) continue;
            sum += min(picture_load(pixel), vec3(60000.0));
            count += 1.0;
        }
    }
    vec4 own = vec4(sum / max(count, 1.0), count);
    for (uint level = 0; level < BLOOM_LEVELS; level++) {
        if (level > 0) {
            // four texels of the previous level become one, weighted by the pixels that they cover
            barrier();
            uint step = 1u << (level - 1);
            bool takes = (gl_LocalInvocationID.x | gl_LocalInvocationID.y) % (2 * step) == 0;
            if (takes) {
                vec4 a = texels[local], b = texels[local + step], c = texels[local + 16 * step], d = texels[local + 17 * step];
                float pixels = a.w + b.w + c.w + d.w;
                own = vec4((a.rgb * a.w + b.rgb * b.w + c.rgb * c.w + d.rgb * d.w) / max(pixels, 1.0), pixels);
            }
            barrier();
            if (!takes) own.w = 0.0;
        }
        texels[local] = own;
        ivec2 size = bloom_size(level);
        ivec2 texel = place >> level;
        bool first = (gl_LocalInvocationID.x | gl_LocalInvocationID.y) % (1u << level) == 0;
        if (first && texel.x < size.x && texel.y < size.y)
            BloomTexels(VIEW.post.bloom).at[bloom_start(level) + uint(texel.y * size.x + texel.x)] = bloom_pack(own.rgb);
    }
}
