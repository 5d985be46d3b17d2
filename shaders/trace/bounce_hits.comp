#version 460
// Shades the hits of `bounce_rays.rgen` and samples a light for each; `bounce_light.rgen` traces the shadow rays.
#include "trace/clock.glsl"
#include "trace/screen.glsl"
#include "trace/vertex_light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// 1: light of further bounces is added at the last one. 0 removes the code.
layout(constant_id = 16) const uint AMBIENT = 0;

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer CellLights { vec3 at[]; };

// Radiance that further bounces would bring to the last vertex of a path: a part of the mean light of its cell, less
// after a long ray (Willberger, Musterle, Bergmann, Deferred Hybrid Path Tracing, 2019, equation 3).
vec3 ambient_light(PathVertex v, vec3 origin) {
    uint cell = cell_at(v.position + v.face_normal);
    float part = VIEW.transport.ambient * exp(-VIEW.transport.ambient_fall * distance(v.position, origin));
    return CellLights(VIEW.lights.cell_light).at[cell] * (part * VIEW.lights.scale);
}

// Live, a specular path goes on for sure from this inverse specular albedo on.
const float SURELY_SHOWN = 4.0;

float surface_distance(Hit hit, vec3 origin) {
    SurfacePoint p = surface_point(hit);
    return p.kind == KIND_SKY ? FAR : distance(p.position, origin);
}

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(cell, bounce_cells()))) return;
    ivec2 pixel = bounce_pixel(cell);
    if (any(greaterThanEqual(pixel, ivec2(VIEW.width, VIEW.height))) || starts_nothing(cell, pixel)) return;
    LightTask task = bounce_task(pixel);
    BounceLight b = BounceLight(vec3(0.0), no_light(), vec3(0.0), true);
    PathVertex v = first_vertex(task);
    float random = 0.5;
    vec3 throughput;
    uint chain;
    Hit hit = bounce_hit_read(cell, throughput, chain);
    bool onward = false;
    GlossPixel gloss;
    if (gathers(task, gloss)) {
        random = bounce_random(task, push.number, BOUNCE_HITS, path_stream());
        vec3 origin = vertex_origin(v);
        if (push.number > 0) origin = bounce_origin_read(cell, b.found);
        else if (is_specular() || VIEW.transport.mirror_count > 0) bounce_origin_read(cell, b.found);
        if (is_specular() && push.number == 0) {
            // the filter of live frames reprojects by this distance
            gloss.hit_distance = hit.geometry == NO_HIT ? 0.0 : surface_distance(hit, origin);
            gloss_write(pixel, gloss);
        }
        float most = is_specular() && push.number == 0 ? most_specular_light(gloss) : MOST_LIVE_LIGHT;
        bool on_screen = SCREEN_HITS != 0 && hit.geometry == SCREEN_HIT;
        if (on_screen) screen_shade(hit, origin, throughput, b.found);
        onward = !on_screen && hit.geometry != NO_HIT && bounce_shade(hit, origin, chain, most, throughput, b.found, v);
        if (onward) {
            vec3 known;
            if (VERTEX_LIGHT != 0 && v.chain == CHAIN_NONE && vertex_light_at(hit, v.face_normal, known)) {
                b.found += throughput * known;
                b.light = changing_light(v);
                b.light.light *= throughput;
                onward = false;
            } else if (v.chain == CHAIN_NONE) {
                b.light = vertex_light(v);
                b.light.light *= throughput;
                if (AMBIENT != 0) b.found += throughput * ambient_light(v, origin);
                if (CAUSTICS != 0) b.found += throughput * photon_light(v.position, v.face_normal, v.normal);
            } else if (v.chain == CHAIN_ROUGH) {
                b.light = rough_light(v, LAST_BOUNCE == 0);
                b.light.light *= throughput;
                b.diffuse = false;
                onward = rough_direction(v, throughput);
            }
            b.origin = vertex_origin(v);
            if (is_specular() && (VIEW.flags & VIEW_ACCUMULATE) == 0) {
                // Russian roulette by what the surface shows of the light
                float chance = min(SURELY_SHOWN * max_component(gloss.lobe_albedo), 1.0);
                onward = onward && rng_next() < chance;
                throughput /= max(chance, 1.0e-3);
            }
        }
    }
    bounce_light_write(cell, b, random);
    if (LAST_BOUNCE == 0) bounce_vertex_write(cell, v, onward ? throughput : vec3(0.0));
    add_pixel_time(pixel);
}
