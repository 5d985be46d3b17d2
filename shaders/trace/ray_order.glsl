// Sorts the rays of a tile of pixels by direction, because the GPU traces neighbouring rays faster if they are coherent
// (Deligiannis and Schmid, It Just Works: Ray-Traced Reflections in Battlefield V, GDC 2019).
#ifndef RELIGHT_TRACE_RAY_ORDER_GLSL
#define RELIGHT_TRACE_RAY_ORDER_GLSL

#include "trace/direction.glsl"
#include "trace/view.glsl"

const uint TILE_RAYS = RAY_TILE * RAY_TILE;

// The pixel (possibly outside of the picture) of the ray in sorted position `slot`; `place`: of the pixel in its tile.
ivec2 pixel_of_slot(uint slot, uvec2 place) {
    uint tiles = (VIEW.width + RAY_TILE - 1) / RAY_TILE, tile = slot / TILE_RAYS;
    return ivec2(RAY_TILE * uvec2(tile % tiles, tile / tiles) + place);
}

const uvec2 NO_PLACE = uvec2(RAY_TILE);

#ifdef SORTS_RAYS
shared uint ray_counts[2][TILE_RAYS];
shared uint compacted_count;
shared uint compacted[TILE_RAYS];

// The bits of a number below 16, a zero bit between each two.
uint spread_bits(uint v) {
    v = (v | v << 2) & 0x33u;
    return (v | v << 1) & 0x55u;
}

// Sorted position of this invocation's ray; all invocations of the work group must call it. Cells of the sphere are
// ordered along a Morton curve, which keeps neighbours together. `sent`: there is a ray.
uint ray_slot(vec3 direction, bool sent) {
    uint self = gl_LocalInvocationIndex;
    uvec2 cell = uvec2(clamp(octahedral(direction) * 8.0 + 8.0, 0.0, 15.0));
    uint key = sent ? spread_bits(cell.x) | spread_bits(cell.y) << 1 : TILE_RAYS - 1;
    ray_counts[0][self] = 0;
    barrier();
    uint rank = atomicAdd(ray_counts[0][key], 1);
    barrier();
    // prefix sum over the cells (Hillis and Steele, Data Parallel Algorithms, 1986)
    uint from = 0;
    for (uint step = 1; step < TILE_RAYS; step *= 2) {
        uint sum = ray_counts[from][self];
        if (self >= step) sum += ray_counts[from][self - step];
        from ^= 1;
        ray_counts[from][self] = sum;
        barrier();
    }
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    return tile * TILE_RAYS + (key == 0 ? 0 : ray_counts[from][key - 1]) + rank;
}

// Compacts the pixels of a tile whose invocations pass `want`, so that their rays run side by side. Returns the
// position in the tile of compacted pixel number `slot`, or NO_PLACE if there are fewer. All invocations of the work
// group must call it.
uvec2 compacted_place(uint slot, bool want) {
    if (gl_LocalInvocationIndex == 0) compacted_count = 0;
    barrier();
    if (want) compacted[atomicAdd(compacted_count, 1)] = gl_LocalInvocationIndex;
    barrier();
    uint number = slot % TILE_RAYS;
    if (number >= compacted_count) return NO_PLACE;
    return uvec2(compacted[number] % RAY_TILE, compacted[number] / RAY_TILE);
}
#endif

#endif
