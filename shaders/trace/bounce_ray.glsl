// Data that the passes of a bounce exchange: 64 bytes for each cell of 2 x 2 pixels, which are the scratch texels of its
// four pixels. One pixel of a cell gathers bounced light at a time.
#ifndef RELIGHT_TRACE_BOUNCE_RAY_GLSL
#define RELIGHT_TRACE_BOUNCE_RAY_GLSL

#include "trace/bounce.glsl"
#include "trace/light_ray.glsl"
#include "trace/specular_surface.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 16) buffer BounceTexels { uvec4 at[]; };

// The pixel of a cell that this run gathers for: the frame's own, or each of the four in turns. May be off the picture.
ivec2 bounce_pixel(ivec2 cell) {
    if ((VIEW.flags & VIEW_SUBSAMPLED_BOUNCE) != 0) return subsample_pixel(cell);
    return cell * CELL + ivec2(push.part & 1u, push.part >> 1u & 1u);
}

// Whether the path gathers specular light of the pixel's surface; otherwise diffuse light.
bool is_specular() { return HAS_GLOSS != 0 && (push.part & PART_SPECULAR) != 0; }

// Number of the path, of those that the pixel traces in this frame for this light.
uint path_number() { return (push.part & ~PART_SPECULAR) >> PART_PATH_SHIFT; }

// Number of the path for its random numbers.
uint path_stream() { return path_number() + (is_specular() ? SPECULAR_PATHS : 0); }

uint bounce_count() { return is_specular() ? VIEW.transport.specular_bounces : VIEW.transport.bounces; }

bool is_last_bounce() { return push.number + 1 >= bounce_count(); }

// The surface from which the path starts. Specular light has no gradient samples.
LightTask bounce_task(ivec2 pixel) {
    return is_specular() ? LightTask(gbuffer_read(pixel), pixel, VIEW.seed) : light_task(pixel);
}

// Whether a path starts at the surface; `gloss`: its specular reflection, for specular light.
bool gathers(LightTask task, out GlossPixel gloss) {
    gloss = NO_GLOSS_PIXEL;
    if (task.surface.view_distance < 0.0 || (VIEW.flags & VIEW_FULLBRIGHT) != 0) return false;
    if (!is_specular()) return true;
    gloss = gloss_read(task.pixel);
    return is_glossy(gloss.gloss);
}

// Whether no path starts at the pixel of a cell. Nothing reads what these passes would write for it.
bool starts_nothing(ivec2 cell, ivec2 pixel) { return is_specular() ? !is_glossy(gloss_read(pixel).gloss) : !is_selected(cell); }

// Bound of the light of a specular path in live frames: relative to the specular albedo.
float most_specular_light(GlossPixel gloss) { return MOST_LIVE_LIGHT / max(max_component(gloss.lobe_albedo), 1.0e-3); }

// Makes the first vertex of a specular path from a pixel's surface; its throughput is relative to the specular albedo.
PathVertex rough_vertex(LightTask task, GlossPixel gloss, out vec3 throughput) {
    PathVertex v = first_vertex(task);
    v.chain = CHAIN_ROUGH;
    v.gloss = gloss.gloss;
    v.to_viewer = gloss.to_viewer;
    throughput = 1.0 / max(specular_albedo(v.gloss, gloss_view(v.normal, v.to_viewer).cosine), 1.0e-4);
    return v;
}

bool gathers(LightTask task) {
    GlossPixel gloss;
    return gathers(task, gloss);
}

ivec2 bounce_cells() { return (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL; }

// Index of quarter `part` of a cell's record. The same quarters of all cells are contiguous.
uint bounce_place(ivec2 cell, uint part) {
    ivec2 cells = bounce_cells();
    return uint(cells.x * cells.y) * part + uint(cell.y * cells.x + cell.x);
}

// Whether paths have a throughput other than 1 before the surface that a ray meets.
bool has_throughput() { return VIEW.transport.roulette != 0 || VIEW.transport.filter_count != 0 || VIEW.transport.bounces > 1 || is_specular(); }

// Writes the hit of a bounce ray, and the throughput of the path before the hit surface. `chain`: how the ray started.
void bounce_hit_write(ivec2 cell, Hit hit, vec3 throughput, uint chain) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 0)] = uvec4(hit.geometry, hit.primitive, floatBitsToUint(hit.barycentrics));
    if (has_throughput()) texels.at[bounce_place(cell, 1)] = uvec4(floatBitsToUint(throughput), chain);
}

// The distance is not stored; it follows from the point on the triangle.
Hit bounce_hit_read(ivec2 cell, out vec3 throughput, out uint chain) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 hit = texels.at[bounce_place(cell, 0)];
    throughput = vec3(1.0);
    chain = CHAIN_NONE;
    if (has_throughput()) {
        uvec4 rest = texels.at[bounce_place(cell, 1)];
        throughput = uintBitsToFloat(rest.xyz);
        chain = rest.w;
    }
    return Hit(hit.x, hit.y, uintBitsToFloat(hit.zw), 0.0);
}

// Writes the directions of the vertex from which the next bounce starts, in place of the hit; its position is the origin of
// the shadow ray. `throughput`: 0 if the path has ended.
void bounce_vertex_write(ivec2 cell, PathVertex v, vec3 throughput) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec2 direction = v.chain == CHAIN_NONE ? uvec2(0) : pack_direction(v.direction, uvec2(0));
    texels.at[bounce_place(cell, 0)] = uvec4(pack_normal(v.face_normal), pack_normal(v.normal), direction);
    texels.at[bounce_place(cell, 1)] = uvec4(floatBitsToUint(throughput), v.chain);
}

// The vertex, without its position.
PathVertex bounce_vertex_read(ivec2 cell, out vec3 throughput) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 directions = texels.at[bounce_place(cell, 0)], path = texels.at[bounce_place(cell, 1)];
    throughput = uintBitsToFloat(path.xyz);
    return PathVertex(vec3(0.0), unpack_normal(directions.x), unpack_normal(directions.y), path.w, unpack_direction(directions.zw), NO_GLOSS, vec3(0.0));
}

// A shadow ray to a light, which starts where the next bounce does, and the radiance found before it.
struct BounceLight {
    vec3 origin;
    LightSample light;
    vec3 found;
    bool diffuse; // the light is of a diffuse surface, which photons light too
};

// `dither`: see `pack_light`.
void bounce_light_write(ivec2 cell, BounceLight b, float dither) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    texels.at[bounce_place(cell, 2)] = uvec4(floatBitsToUint(b.origin), pack_light(finite_light(b.found), dither));
    texels.at[bounce_place(cell, 3)] = pack_light_ray(b.light, uvec2(b.diffuse ? 0 : 1, 0), b.light.sky, dither);
}

BounceLight bounce_light_read(ivec2 cell) {
    BounceTexels texels = BounceTexels(VIEW.scratch);
    uvec4 found = texels.at[bounce_place(cell, 2)];
    uvec2 spare;
    bool sky;
    LightSample light = unpack_light_ray(texels.at[bounce_place(cell, 3)], spare, sky);
    light.sky = sky;
    return BounceLight(uintBitsToFloat(found.xyz), light, unpack_light(found.w), spare.x == 0);
}

// Origin of the last shadow ray, and the radiance found so far.
vec3 bounce_origin_read(ivec2 cell, out vec3 found) {
    uvec4 texel = BounceTexels(VIEW.scratch).at[bounce_place(cell, 2)];
    found = unpack_light(texel.w);
    return uintBitsToFloat(texel.xyz);
}

// Replaces the radiance found so far. `dither`: see `pack_light`.
void bounce_found_write(ivec2 cell, vec3 found, float dither) {
    BounceTexels(VIEW.scratch).at[bounce_place(cell, 2)].w = pack_light(finite_light(found), dither);
}

#endif
