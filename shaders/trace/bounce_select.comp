#version 460
// Marks the cells that trace rays of bounces in this frame: those whose history has too few samples (Willberger, Musterle,
// Bergmann, Deferred Hybrid Path Tracing, Ray Tracing Gems, 2019, section 26.4.1), or whose light has changed; and tiles in
// turns, which find changes of the bounced light.
#include "trace/subsample.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Change of the last frame's light, as a part of it, from which on a cell traces.
const float CHANGED = 0.1;

// Tiles of 8 x 8 pixels trace in two successive frames of nine: the second shades the samples of the first again. Any
// place is at most 16 pixels from such a tile, and gradients are filtered over 54. The number of frames shares no factor
// with the four pixels of a cell, which therefore all take turns.
const int PROBE_TILE = 4;
const uint PROBE_FRAMES = 9u, PROBE_SUCCESSIVE = 2u;

bool probes(ivec2 cell) {
    ivec2 tile = cell / PROBE_TILE;
    uint turn = uint(tile.x % 3 * 2 + tile.y % 3 * 3 * 2);
    return (VIEW.seed + turn) % PROBE_FRAMES < PROBE_SUCCESSIVE;
}

// Number of samples that a history has of the bounced light of the pixel's surface.
float samples_in(LightTexels texels, LastPixel last, ivec2 pixel, float view_distance) {
    if (!(last.depth > 0.0)) return 0.0;
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).xy;
    vec3 way = place_ahead(pixel, 1.0) - VIEW.camera.origin;
    float cosine = max(abs(dot(unpack_normal(surface.x), way)), 0.05);
    float slope = VIEW.camera.pixel_spread * sqrt(1.0 - min(cosine * cosine, 1.0)) / cosine;
    float tolerance = last.depth * (0.01 + 3.0 * slope) + 0.1;
    vec2 low = floor(last.pixel), part = last.pixel - low;
    uint guide = pack_guide(depth_of(pixel, view_distance), unpack_normal(surface.y), mark_field(mark_read(pixel)) == 2.0);
    float sum = 0.0, weight = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1), tap = ivec2(low) + offset;
        float share = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
        if (!inside(tap) || share < 1.0e-3) continue;
        uvec4 texel = texels.at[place_of(tap)];
        if (texel.w == 0 || abs(guide_depth(texel.w) - last.depth) > tolerance) continue;
        if (((texel.w ^ guide) & REFLECTION_BIT) != 0 || dot(guide_normal(texel.w & ~REFLECTION_BIT), unpack_normal(surface.y)) < 0.85) continue;
        sum += past_frames(texel.z).y * share;
        weight += share;
    }
    return weight < 0.01 ? 0.0 : sum / weight;
}

// The number in the last frame, and of the other eye.
float samples_at(ivec2 pixel, float view_distance) {
    float own = samples_in(LightTexels(DENOISE.history), last_pixel_of(pixel), pixel, view_distance) * distortion(pixel);
    if (SHARED_EYES == 0) return own;
    float depth = depth_of(pixel, view_distance);
    return max(own, samples_in(LightTexels(DENOISE.other_eye), LastPixel(other_eye_pixel(pixel, depth), depth), pixel, view_distance));
}

bool needs_samples(ivec2 pixel) {
    if (!inside(pixel)) return false;
    float view_distance = lit_distance_read(pixel, distance_tail_read(pixel));
    if (view_distance < 0.0) return false;
    if ((DENOISE.flags & DENOISE_GRADIENTS) != 0) {
        vec2 change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
        if (max(change.x, change.y) > CHANGED) return true;
    }
    // at least the first sample
    vec2 aside = (vec2(pixel) + 0.5) / vec2(VIEW.width, VIEW.height) * 2.0 - 1.0;
    float wanted = VIEW.transport.bounce_samples * (1.0 - VIEW.transport.foveation * 0.5 * dot(aside, aside));
    return samples_at(pixel, view_distance) < max(wanted, 1.0e-3);
}

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(cell, (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL))) return;
    bool selected = SHARED_EYES == 0 && (DENOISE.flags & DENOISE_HISTORY) == 0 || probes(cell);
    for (int i = 0; i < CELL * CELL && !selected; i++) selected = needs_samples(cell * CELL + ivec2(i & 1, i >> 1));
    imageStore(uimages_r32ui[DENOISE.selected], cell, uvec4(selected ? 1 : 0));
}
