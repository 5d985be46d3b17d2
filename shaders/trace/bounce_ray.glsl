// Data that the passes of a single bounce exchange: 64 bytes for each cell of 2 x 2 pixels, which are the scratch texels
// of its four pixels. One pixel of a cell gathers bounced light.
#ifndef RELIGHT_TRACE_BOUNCE_RAY_GLSL
#define RELIGHT_TRACE_BOUNCE_RAY_GLSL

#include "trace/bounce.glsl"
#include "trace/light_ray.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer BounceTexels { uvec4 at[]; };

ivec2 bounce_cells() { return (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL; }

// Index of quarter `part` of a cell's record. The same quarters of all cells are contiguous.
uint bounce_place(ivec2 cell, uint part) {
    ivec2 cells = bounce_cells();
    return uint(cells.x * cells.y) * part + uint(cell.y * cells.x + cell.x);
}

// Writes the hit of a bounce ray, and the colour by which filters on its way tint the light.
void bounce_hit_write(ivec2 cell, Hit hit, vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 0)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.barycentrics));
    if (VIEW.transport.filter_count != 0) texels.at[bounce_place(cell, 1)] = uvec4(floatBitsToUint(color), 0);
}

// The distance is not stored; it follows from the point on the triangle.
Hit bounce_hit_read(ivec2 cell, out vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 hit = texels.at[bounce_place(cell, 0)];
    color = vec3(1.0);
    if (VIEW.transport.filter_count != 0) color = uintBitsToFloat(texels.at[bounce_place(cell, 1)].xyz);
    return Hit(hit.x, hit.y, uintBitsToFloat(hit.zw), 0.0);
}

// A shadow ray to a light, and the radiance found before it.
struct BounceLight {
    vec3 origin;
    LightSample light;
    vec3 found;
};

// `dither`: see `pack_light`.
void bounce_light_write(ivec2 cell, BounceLight b, float dither) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 2)] = uvec4(floatBitsToUint(b.origin), pack_light(finite_light(b.found), dither));
    texels.at[bounce_place(cell, 3)] = pack_light_ray(b.light, uvec2(0), b.light.sky, dither);
}

BounceLight bounce_light_read(ivec2 cell) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 found = texels.at[bounce_place(cell, 2)];
    uvec2 spare;
    bool sky;
    LightSample light = unpack_light_ray(texels.at[bounce_place(cell, 3)], spare, sky);
    light.sky = sky;
    return BounceLight(uintBitsToFloat(found.xyz), light, unpack_light(found.w));
}

#endif
