#version 460
// Keeps the frame's depth and light for the bounces of the next frame: albedo * (direct + indirect light) + emission. The
// indirect light contains that of earlier frames, so that the number of bounces grows with the frames.
#include "trace/screen.glsl"

const int TILE = 8, WIDE = TILE + 2;
layout(local_size_x = TILE, local_size_y = TILE) in;

// Of the work group's pixels and those around: distance to the first surface, negative without light.
shared float distances[WIDE * WIDE];

float distance_at(ivec2 pixel) {
    uvec2 kept = imageLoad(uimages_rg32ui[VIEW.screen.surface], pixel).xy;
    return kept.x == SCREEN_NO_LIGHT ? -uintBitsToFloat(kept.y) : view_distance_read(pixel);
}

void main() {
    ivec2 end = ivec2(VIEW.width, VIEW.height) - 1, corner = ivec2(gl_WorkGroupID.xy) * TILE - 1;
    for (int i = int(gl_LocalInvocationIndex); i < WIDE * WIDE; i += TILE * TILE)
        distances[i] = distance_at(clamp(corner + ivec2(i % WIDE, i / WIDE), ivec2(0), end));
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    int own = (int(gl_LocalInvocationID.y) + 1) * WIDE + int(gl_LocalInvocationID.x) + 1;
    float nearest = SKY_DISTANCE;
    for (int i = 0; i < 9; i++) nearest = min(nearest, abs(distances[own + (i / 3 - 1) * WIDE + i % 3 - 1]));
    imageStore(uimages_r32ui[VIEW.screen.depth], pixel, uvec4(packHalf2x16(vec2(distances[own], nearest * (1.0 - 1.0 / 2048.0)))));
    if (!(distances[own] > 0.0)) return;
    uvec2 kept = imageLoad(uimages_rg32ui[VIEW.screen.surface], pixel).xy;
    vec3 light = unpack_light(kept.y);
    if (is_lit_read(pixel)) light += unpack_light(kept.x) * light_of(pixel);
    light_write(VIEW.screen.light, pixel, light, dither(pixel, DITHER_SCREEN));
}
