#version 460
// First pass of the sparse filter: adds the light of this frame to the running mean, where the surface was visible in
// the last frame.
#include "trace/sparse_filter.glsl"
#include "trace/depth_gradient.glsl"

const float MIN_WEIGHT = 1.0 / float(SPARSE_FRAMES + 1);

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    load_depths();
    if (!inside(pixel)) return;
    float depth = own_depth();
    if (depth == 0.0) {
        SparseTexels(DENOISE.fresh).at[place_of(pixel)] = uvec2(0);
        return;
    }
    vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).y);
    float field = mark_field(mark_read(pixel));
    uint reflection = field == 2.0 ? REFLECTION_BIT : 0u;
    vec2 depth_gradient = depth_gradient_at(depth, field > 0.0);
    SparseTexel texel;
    texel.light = light_read(VIEW.images.direct, pixel) + light_read(VIEW.images.indirect, pixel);

    vec3 old = vec3(0.0);
    float frames = 0.0, sum = 0.0;
    LastPixel last = last_pixel_of(pixel);
    if ((DENOISE.flags & DENOISE_HISTORY) != 0 && last.depth > 0.0) {
        float tolerance = last.depth * (0.01 + 2.0 * (abs(depth_gradient.x) + abs(depth_gradient.y))) + 0.1;
        vec2 low = floor(last.pixel), part = last.pixel - low;
        for (int i = 0; i < 4; i++) {
            ivec2 offset = ivec2(i & 1, i >> 1), tap = ivec2(low) + offset;
            float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
            if (weight < 1.0e-3 || !inside(tap)) continue;
            SparseTexel other = sparse_read(DENOISE.history, tap);
            if (other.guide == 0 || (other.guide & REFLECTION_BIT) != reflection || abs(sparse_depth(other.guide) - last.depth) > tolerance
                || dot(sparse_normal(other.guide), normal) < 0.8) continue;
            old += other.light * weight;
            frames += sparse_frames(other.guide) * weight;
            sum += weight;
        }
    }
    if (sum > 0.01) {
        frames /= sum;
        texel.light = mix(old / sum, texel.light, max(1.0 / (frames + 1.0), MIN_WEIGHT));
    } else {
        frames = 0.0;
    }
    float random = dither(pixel, DITHER_FRESH);
    texel.guide = pack_sparse_guide(depth, normal, reflection != 0u, uint(frames + 1.0 + random));
    sparse_write(DENOISE.fresh, pixel, texel, dither(pixel, DITHER_PAST));
    imageStore(images_rg16f[DENOISE.depth_gradient], pixel, vec4(depth_gradient, 0.0, 0.0));
}
