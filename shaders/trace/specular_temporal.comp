#version 460
// Specular light of each pixel: the mean of the paths around it, weighted by likeness, joined with the light of earlier
// frames. What a smooth surface reflects moves like a point behind it (the virtual hit point: Deferred Hybrid Path Tracing,
// Ray Tracing Gems, section 26.5), so that the history comes from where the last frame's camera saw that point. Changes
// of diffuse light shorten it; while something moves, it is clamped to the range of the paths around.
#include "trace/specular_filter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Standard deviations of the paths around a pixel that history may differ from their mean.
const float RANGE = 4.0;
// From this roughness on the history follows the surface.
const float ROUGH_MOTION = 0.6;

// Light of the last frame at a point of the picture; `frames` 0: unknown. `plane`: of the surface in the last frame.
SpecularTexel history_at(vec2 place, vec4 plane, float roughness) {
    SpecularTexel sum = SpecularTexel(vec3(0.0), 0.0, roughness, 0.0);
    float total = 0.0;
    vec2 low = floor(place - 0.5), part = place - 0.5 - low;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1), tap = ivec2(low) + offset;
        float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
        if (weight < 1.0e-3 || !inside(tap)) continue;
        SpecularTexel other = specular_texel_read(VIEW.images.last_specular, tap);
        if (other.frames == 0.0 || abs(other.roughness - roughness) > 0.1) continue;
        float seen = abs(last_view_distance_read(tap));
        float expected = (plane.w - dot(plane.xyz, VIEW.last_camera.origin)) / dot(plane.xyz, last_direction(vec2(tap) + 0.5));
        if (!(abs(expected - seen) < 0.02 * seen + 0.5)) continue;
        sum.light += other.light * weight;
        sum.frames += other.frames * weight;
        total += weight;
    }
    if (total < 0.01) return SpecularTexel(vec3(0.0), 0.0, roughness, 0.0);
    sum.light /= total;
    sum.frames /= total;
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    GlossPixel gloss = gloss_read(pixel);
    vec4 place = place_read(pixel);
    if (!is_glossy(gloss.gloss) || place.w < 0.0) {
        specular_texel_write(VIEW.images.fresh_specular, pixel, SpecularTexel(vec3(0.0), 0.0, 0.0, 0.0), 0.5);
        return;
    }
    float roughness = roughness_of(gloss.gloss);
    uvec2 surface = imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).xy;
    vec3 face = unpack_normal(surface.x), normal = unpack_normal(surface.y);
    float tolerance = 0.1 + 6.0 * place.w * VIEW.camera.pixel_spread;
    ivec2 cell = pixel / CELL, cells = (ivec2(VIEW.width, VIEW.height) + CELL - 1) / CELL;
    vec3 sum = vec3(0.0), mean = vec3(0.0), squares = vec3(0.0);
    float total = 0.0, alike = 0.0, hit_distance = 0.0;
    // a lobe that is sharp on the screen takes the pixel's own path, which it has in one of four frames; a wide one all nine
    float radius = lobe_radius(roughness, min(gloss_read(subsample_pixel(cell)).hit_distance, 4096.0), place.w);
    float reach = clamp(0.25 * radius * radius, 0.2, 8.0);
    for (int i = 0; i < 9; i++) {
        ivec2 at = cell + ivec2(i % 3 - 1, i / 3 - 1);
        if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, cells))) continue;
        ivec2 traced = subsample_pixel(at);
        GlossPixel other = gloss_read(traced);
        if (!is_glossy(other.gloss)) continue;
        vec3 other_normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], traced).y);
        vec2 off = vec2(pixel - traced);
        float weight = likeness(place, normal, roughness, place_read(traced), other_normal, roughness_of(other.gloss), tolerance);
        if (!(weight > 0.0)) continue;
        vec3 light = light_read(VIEW.images.specular_light, traced);
        mean += light * weight;
        squares += light * light * weight;
        alike += weight;
        weight *= exp(-dot(off, off) / reach) + 1.0e-4;
        sum += light * weight;
        hit_distance += min(other.hit_distance, 4096.0) * weight;
        total += weight;
    }
    SpecularTexel texel = SpecularTexel(vec3(0.0), 1.0, roughness, 0.0);
    if (total > 0.0) {
        sum /= total;
        texel.light = sum;
        texel.hit_distance = hit_distance / total;
    }
    if ((VIEW.flags & VIEW_HISTORY) != 0 && VIEW.images.last_specular != NO_IMAGE) {
        Motion motion = motion_read(pixel);
        vec2 seen = vec2(pixel) + 0.5 + motion.offset;
        vec3 at = place_ahead(pixel, place.w);
        bool direct = distance(at, place.xyz) < 0.1 + 0.01 * place.w, moved = motion.last_view_distance < 0.0;
        vec4 plane = vec4(face, dot(face, place.xyz));
        if (direct && rests_in_last(motion, place.xyz)) {
            float behind = texel.hit_distance * clamp(1.0 - roughness / ROUGH_MOTION, 0.0, 1.0);
            seen = last_seen(place_ahead(pixel, place.w + behind));
        } else if (!direct) {
            // seen in a mirror: the plane lies at its image
            vec3 image = at;
            plane = vec4(normalize(VIEW.camera.origin - image), 0.0);
            plane.w = dot(plane.xyz, image);
        }
        SpecularTexel old = SpecularTexel(vec3(0.0), 0.0, roughness, 0.0);
        if (!moved) old = history_at(seen, plane, roughness);
        if (old.frames > 0.0 && total > 0.0) {
            mean /= alike;
            vec3 deviation = sqrt(max(squares / alike - mean * mean, 0.0));
            bool gradients = (DENOISE.flags & DENOISE_GRADIENTS) != 0, rests = gradients && VIEW.motion.still != 0;
            vec3 clamped = rests ? old.light : clamp(old.light, mean - RANGE * deviation - 0.02, mean + RANGE * deviation + 0.02);
            // a clamp that changes much shortens the history
            float kept = 1.0 - clamp(luminance(abs(clamped - old.light)) / max(luminance(max(old.light, sum)), 1.0e-4), 0.0, 1.0);
            if (gradients) {
                // the light that changes here changes there, too
                vec2 change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
                kept *= 1.0 - clamp(max(change.x, change.y), 0.0, 1.0);
            }
            float fresh = min(total, 1.0);
            texel.frames = min(old.frames * kept + fresh, SPECULAR_FRAMES);
            texel.light = mix(mix(clamped, old.light, 0.5 * kept), sum, min(fresh / texel.frames, 1.0));
        } else if (old.frames > 0.0) texel = SpecularTexel(old.light, old.frames, roughness, old.hit_distance);
    }
    specular_texel_write(VIEW.images.fresh_specular, pixel, texel, dither(pixel, DITHER_SPECULAR));
}
