#version 460
// Reprojects gradient samples (see `gradient_reproject.glsl`). One invocation handles one stratum: it projects each of
// its pixels to the last frame and selects the pixel nearest to a sample.
#include "trace/gradient_reproject.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Largest distance between a sample and the reprojected pixel, pixels.
const float REACH = 1.0;

// Whether the sample lies on the surface that the pixel shows. `moved`: the surface has moved since.
bool same_surface(LitSample s, ivec2 pixel, float last_view_distance, out bool moved) {
    vec4 position = place_read(pixel);
    moved = false;
    if (position.w < 0.0) return false;
    vec3 face_normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).x);
    vec3 away = s.position - position.xyz;
    float footprint = position.w * VIEW.camera.pixel_spread;
    if (dot(s.face_normal, face_normal) > 0.9 && abs(dot(away, face_normal)) < 0.05 + 0.5 * footprint
        && dot(away, away) < 1.0 + 100.0 * footprint * footprint) return true;
    moved = true;
    return abs(s.view_distance - last_view_distance) < 0.02 * last_view_distance + 0.1;
}

void main() {
    ivec2 stratum = ivec2(gl_GlobalInvocationID.xy);
    ivec2 first = stratum * STRATUM;
    if (!inside(first)) return;

    ivec2 middle = min(first + 1, ivec2(VIEW.width, VIEW.height) - 1);
    float view_distance = lit_distance_read(middle, distance_tail_read(middle));
    uint guide = 0;
    if (view_distance >= 0.0) guide = pack_guide(depth_of(middle, view_distance), unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], middle).x), false);
    imageStore(uimages_r32ui[DENOISE.stratum_guide], stratum, uvec4(guide));

    float nearest = REACH;
    int found = -1;
    float found_distance = 0.0;
    bool rests = false;
    ivec2 place = ivec2(0);
    for (int i = 0; i < 9; i++) {
        ivec2 pixel = pixel_of(stratum, i);
        if (!inside(pixel)) continue;
        vec4 motion = imageLoad(images_rgba16f[VIEW.images.motion], pixel);
        vec2 before = vec2(pixel) + motion.xy;
        ivec2 last = ivec2(floor(before + 0.5));
        if (motion.z < 0.0 || !inside(last)) continue;
        uint packed = imageLoad(uimages_rgba32ui[DENOISE.samples], last / STRATUM).w;
        if (packed == NO_GRADIENT_PIXEL) continue;
        vec2 off = abs(before - vec2(unpack_place(packed)));
        float distance = max(off.x, off.y);
        if (distance >= nearest) continue;
        nearest = distance;
        found = i;
        found_distance = motion.z;
        rests = motion.xy == vec2(0.0);
        place = unpack_place(packed);
    }
    uint record = NO_GRADIENT_PIXEL;
    bool moved;
    if (found >= 0 && same_surface(kept_sample(place / STRATUM), pixel_of(stratum, found), found_distance, moved) && !(moved && rests))
        record = pack_gradient_pixel(found, moved, place);
    imageStore(uimages_r32ui[DENOISE.gradient_pixels], stratum, uvec4(record));
}
