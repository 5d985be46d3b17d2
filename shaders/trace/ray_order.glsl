// Rays in the order of where they go: those of a tile of pixels are sorted by direction, because rays that are followed
// side by side are followed the faster the longer they go the same way (Deligiannis and Schmid, It Just Works: Ray-Traced
// Reflections in Battlefield V, GDC 2019).
#ifndef RELIGHT_TRACE_RAY_ORDER_GLSL
#define RELIGHT_TRACE_RAY_ORDER_GLSL

#include "trace/direction.glsl"
#include "trace/view.glsl"

const uint TILE_RAYS = RAY_TILE * RAY_TILE;

// The pixel, which may lie beyond the picture, of the ray with number `slot` in this order, from its place in the tile.
ivec2 pixel_of_slot(uint slot, uvec2 place) {
    uint tiles = (VIEW.width + RAY_TILE - 1) / RAY_TILE, tile = slot / TILE_RAYS;
    return ivec2(RAY_TILE * uvec2(tile % tiles, tile / tiles) + place);
}

const uvec2 NO_PLACE = uvec2(RAY_TILE);

#ifdef SORTS_RAYS
shared uint ray_counts[2][TILE_RAYS];
shared uint wanted_count;
shared uint wanted[TILE_RAYS];

// Bits of a number below 16 with room between them.
uint spread_bits(uint v) {
    v = (v | v << 2) & 0x33u;
    return (v | v << 1) & 0x55u;
}

// The number of the calling thread's ray; all threads of a tile ask together. Cells of the sphere are counted along a curve
// that keeps neighbours together (Morton's); `sent`: there is a ray at all.
uint ray_slot(vec3 direction, bool sent) {
    uint self = gl_LocalInvocationIndex;
    uvec2 cell = uvec2(clamp(octahedral(direction) * 8.0 + 8.0, 0.0, 15.0));
    uint key = sent ? spread_bits(cell.x) | spread_bits(cell.y) << 1 : TILE_RAYS - 1;
    ray_counts[0][self] = 0;
    barrier();
    uint rank = atomicAdd(ray_counts[0][key], 1);
    barrier();
    // how many are before each cell (Hillis and Steele, Data Parallel Algorithms, 1986)
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

// The place of that pixel of the tile which has number `slot` among those whose threads `want`, or NO_PLACE where they are
// fewer: so that few of a tile have their rays followed side by side. All threads of a tile ask together.
uvec2 wanted_place(uint slot, bool want) {
    if (gl_LocalInvocationIndex == 0) wanted_count = 0;
    barrier();
    if (want) wanted[atomicAdd(wanted_count, 1)] = gl_LocalInvocationIndex;
    barrier();
    uint number = slot % TILE_RAYS;
    if (number >= wanted_count) return NO_PLACE;
    return uvec2(wanted[number] % RAY_TILE, wanted[number] / RAY_TILE);
}
#endif

#endif
