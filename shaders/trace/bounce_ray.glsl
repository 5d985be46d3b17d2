// What the passes of a single bounce hand on from ray to ray, for each cell of 2 x 2 pixels, of which one gathers: 64 bytes
// in the texels of four pixels.
#ifndef RELIGHT_TRACE_BOUNCE_RAY_GLSL
#define RELIGHT_TRACE_BOUNCE_RAY_GLSL

#include "trace/bounce.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer BounceTexels { uvec4 at[]; };

const uint BOUNCE_SIGN = 0x80000000u;

ivec2 bounce_cells() { return (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL; }

// Where the `part`th quarter of a cell's record is: those of all cells lie together.
uint bounce_place(ivec2 cell, uint part) {
    ivec2 cells = bounce_cells();
    return uint(cells.x * cells.y) * part + uint(cell.y * cells.x + cell.x);
}

// What the ray meets, and what colour its way takes from its light.
void bounce_hit_write(ivec2 cell, Hit hit, vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.texels);
    texels.at[bounce_place(cell, 0)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.barycentrics));
    if (VIEW.transport.filter_count != 0) texels.at[bounce_place(cell, 1)] = uvec4(floatBitsToUint(color), 0);
}

// How far away it is, the point on the triangle tells.
Hit bounce_hit_read(ivec2 cell, out vec3 color) {
    BounceTexels texels = BounceTexels(VIEW.texels);
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
    BounceTexels texels = BounceTexels(VIEW.texels);
    // light from nearer than 0 arrives as that from 0 does, so the sign is free
    uint distance = floatBitsToUint(max(b.light.distance, 0.0)) & ~BOUNCE_SIGN | (b.light.sky ? BOUNCE_SIGN : 0u);
    texels.at[bounce_place(cell, 2)] = uvec4(floatBitsToUint(b.origin), pack_light(sound_light(b.found), dither));
    texels.at[bounce_place(cell, 3)] =
        uvec4(floatBitsToUint(octahedral(b.light.direction)), distance, pack_light(sound_light(b.light.light), dither));
}

BounceLight bounce_light_read(ivec2 cell) {
    BounceTexels texels = BounceTexels(VIEW.texels);
    uvec4 a = texels.at[bounce_place(cell, 2)], b = texels.at[bounce_place(cell, 3)];
    LightSample light = LightSample(from_octahedral(uintBitsToFloat(b.xy)), uintBitsToFloat(b.z & ~BOUNCE_SIGN),
        unpack_light(b.w), (b.z & BOUNCE_SIGN) != 0);
    return BounceLight(uintBitsToFloat(a.xyz), light, unpack_light(a.w));
}

// Whether a pixel gathers bounced light at all.
bool gathers(LightTask task) { return task.surface.path >= 0.0 && (VIEW.flags & VIEW_FULLBRIGHT) == 0; }

PathVertex first_vertex(LightTask task) {
    return PathVertex(task.surface.position, task.surface.face_normal, task.surface.normal);
}

#endif
