#version 460
// First pass of the sparse filter: adds the light of this frame to the running mean, where the surface was visible in
// the last frame. A change of the light shortens the history: over the pixels of a work group the differences between
// fresh light and history cancel if they are noise, and add up if the light has changed.
#define TILE 16
#include "trace/sparse_filter.glsl"
#include "trace/depth_gradient.glsl"

const float MIN_WEIGHT = 1.0 / float(SPARSE_FRAMES + 1);

// Sum of the differences in standard errors: up to the first it counts as noise, from the second on as a change. By
// chance the first is exceeded in one group of 370.
const vec2 CHANGE_ERRORS = vec2(3.0, 5.5);
// Part of the light that a change must have to replace the history.
const float WHOLE_CHANGE = 0.5;

const int BLOCKS = TILE / 2;
// Fresh luminance and that of the history; 0 where there is none.
shared vec2 luminances[TILE * TILE];
// Of each row of blocks of 2 x 2 pixels, which share bounced light: sums of the differences, of their squares, of both
// luminances.
shared vec4 sums[BLOCKS];

// By how much the light of the work group has changed: 0 to 1. Must be called by the whole work group.
float group_change(float fresh, float old) {
    int index = int(gl_LocalInvocationIndex);
    luminances[index] = vec2(fresh, old);
    barrier();
    if (index < BLOCKS) {
        vec4 sum = vec4(0.0);
        for (int i = 0; i < BLOCKS; i++) {
            int place = index * 2 * TILE + i * 2;
            vec2 block = luminances[place] + luminances[place + 1] + luminances[place + TILE] + luminances[place + TILE + 1];
            float difference = block.x - block.y;
            sum += vec4(difference, difference * difference, block);
        }
        sums[index] = sum;
    }
    barrier();
    vec4 all = vec4(0.0);
    for (int i = 0; i < BLOCKS; i++) all += sums[i];
    float errors = abs(all.x) * inversesqrt(max(all.y, 1.0e-12));
    float part = abs(all.x) / max(max(all.z, all.w), 1.0e-6);
    return smoothstep(CHANGE_ERRORS.x, CHANGE_ERRORS.y, errors) * min(part / WHOLE_CHANGE, 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    load_depths();
    float depth = own_depth();
    vec3 light = vec3(0.0), normal = vec3(0.0), old = vec3(0.0);
    float frames = 0.0, sum = 0.0;
    uint reflection = 0u;
    vec2 depth_gradient = vec2(0.0);
    if (depth > 0.0) {
        normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).y);
        float field = mark_field(mark_read(pixel));
        reflection = field == 2.0 ? REFLECTION_BIT : 0u;
        depth_gradient = depth_gradient_at(depth, field > 0.0);
        light = light_read(VIEW.images.direct, pixel) + light_read(VIEW.images.indirect, pixel);
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
    }
    bool known = sum > 0.01;
    if (known) {
        frames /= sum;
        old /= sum;
    } else {
        frames = 0.0;
    }
    float change = group_change(known ? luminance(light) : 0.0, known ? luminance(old) : 0.0);
    if (!inside(pixel)) return;
    if (depth == 0.0) {
        SparseTexels(DENOISE.fresh).at[place_of(pixel)] = uvec2(0);
        return;
    }
    if (known) {
        frames *= 1.0 - change;
        light = mix(old, light, max(max(1.0 / (frames + 1.0), MIN_WEIGHT), change));
    }
    SparseTexel texel;
    texel.light = light;
    texel.guide = pack_sparse_guide(depth, normal, reflection != 0u, uint(frames + 1.0 + dither(pixel, DITHER_FRESH)));
    sparse_write(DENOISE.fresh, pixel, texel, dither(pixel, DITHER_PAST));
    imageStore(images_rg16f[DENOISE.depth_gradient], pixel, vec4(depth_gradient, 0.0, 0.0));
}
