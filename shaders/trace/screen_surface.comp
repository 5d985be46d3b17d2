#version 460
// Keeps, of the first surface that a pixel's ray hits, what a bounce would take: albedo and emission, without layers in
// front and without what depends on the direction (`bounce_shade`). `screen_light.comp` joins them with the light.
#include "trace/primary_hit.glsl"
#include "trace/motion.glsl"
#include "trace/screen.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Relative difference of two view distances of one surface: one of them is a half float.
const float SAME_DISTANCE = 1.0e-3;

// Whether the light of the pixel is that of its first surface, seen directly.
bool shows_first(ivec2 pixel, SurfacePoint p, float distance) {
    float mark = mark_read(pixel);
    return (p.kind == KIND_OPAQUE || p.kind == KIND_TESTED) && mark_field(mark) != 2.0 && !mark_bent(mark)
        && abs(view_distance_read(pixel) - distance) < SAME_DISTANCE * distance + 0.01;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    bool first_person;
    Hit hit = primary_hit_read(pixel, first_person);
    float distance = SKY_DISTANCE;
    uvec2 kept = uvec2(SCREEN_NO_LIGHT, 0);
    if (hit.geometry != NO_HIT) {
        SurfacePoint p = surface_point(hit);
        vec3 direction = p.position - VIEW.camera.origin;
        distance = clamp(length(direction), LEAST_DISTANCE, SKY_DISTANCE);
        direction /= distance;
        if (!first_person && shows_first(pixel, p, distance)) {
            Material material = material_of(p.triangle.material);
            Footprint seen = round_footprint(distance * VIEW.camera.pixel_spread);
            Layer layer = evaluate_stages(p, seen);
            p.normal = mapped_normal(p, material, seen);
            bool mirrors = max_component(mirrored_part(p, direction, layer)) >= MIN_MIRRORED;
            vec3 lobe_albedo;
            take_gloss(p, material, seen, direction, layer.lit, lobe_albedo);
            vec3 albedo = min(clamp(layer.lit, 0.0, 1.0) + lobe_albedo, 1.0);
            bool in_lists = (material.flags & MATERIAL_EMITTER) != 0;
            vec3 emission = in_lists ? vec3(0.0) : max(layer.emission, 0.0);
            if (!mirrors) kept = uvec2(pack_light(albedo, 0.5), pack_light(finite_light(emission), 0.5));
        }
    }
    if (kept.x == SCREEN_NO_LIGHT) kept.y = floatBitsToUint(distance);
    imageStore(uimages_rg32ui[VIEW.screen.surface], pixel, uvec4(kept, 0, 0));
}
