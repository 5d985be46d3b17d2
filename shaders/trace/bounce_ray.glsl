// What the passes of a single bounce hand on from ray to ray, for each cell of 2 x 2 pixels, of which one gathers: 64 bytes
// in the texels of four pixels.
#ifndef RELIGHT_TRACE_BOUNCE_RAY_GLSL
#define RELIGHT_TRACE_BOUNCE_RAY_GLSL

#include "trace/bounce.glsl"
#include "trace/light_ray.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer BounceTexels { uvec4 at[]; };

ivec2 bounce_cells() { return (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL; }

// Where the `part`th quarter of a cell's record is: those of all cells lie together.
uint bounce_place(ivec2 cell, uint part) {
    ivec2 cells = bounce_cells();
    return uint(cells.x * cells.y) * part + uint(cell.y * cells.x + cell.x);
}

// What the ray meets, and what colour its way takes from its light.
void bounce_hit_write(ivec2 cell, Hit hit, vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 0)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.barycentrics));
    if (VIEW.transport.filter_count != 0) texels.at[bounce_place(cell, 1)] = uvec4(floatBitsToUint(color), 0);
}

// How far away it is, the point on the triangle tells.
Hit bounce_hit_read(ivec2 cell, out vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 hit = texels.at[bounce_place(cell, 0)];
    color = vec3(1.0);
    if (VIEW.transport.filter_count != 0) color = uintBitsToFloat(texels.at[bounce_place(cell, 1)].xyz);
    return Hit(hit.x, hit.y, uintBitsToFloat(hit.zw), 0.0);
}

// A ray to a light, and the light that was found before it.
struct BounceLight {
    vec3 origin;
    LightSample light;
    vec3 found;
};

// `dither`: see pack_light.
void bounce_light_write(ivec2 cell, BounceLight b, float dither) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 2)] = uvec4(floatBitsToUint(b.origin), pack_light(sound_light(b.found), dither));
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
