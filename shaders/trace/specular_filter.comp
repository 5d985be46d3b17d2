#version 460
// Smooths specular light over half the lobe's radius on the screen (`lobe_radius`) where the mean has four paths; over more
// with fewer paths, over less with more.
#include "trace/specular_filter.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Taps on a disc: Vogel's spiral, rotated from pixel to pixel.
const int TAPS = 8;
const float GOLDEN_ANGLE = 2.39996323;
// Largest radius, pixels.
const float MOST_RADIUS = 12.0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    SpecularTexel own = specular_texel_read(VIEW.images.fresh_specular, pixel);
    if (own.frames == 0.0) return;
    vec4 place = place_read(pixel);
    vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).y);
    float tolerance = 0.1 + 6.0 * place.w * VIEW.camera.pixel_spread;
    float radius = 0.5 * lobe_radius(own.roughness, own.hit_distance, place.w);
    radius = clamp(radius / sqrt(max(own.frames * 0.25, 0.25)), 0.0, MOST_RADIUS);
    vec3 sum = own.light;
    float total = 1.0;
    if (radius >= 1.0) {
        float turn = 2.0 * PI * dither(pixel, DITHER_SPECULAR_TURN);
        for (int i = 0; i < TAPS; i++) {
            float angle = float(i) * GOLDEN_ANGLE + turn, out_to = radius * sqrt((float(i) + 0.5) / float(TAPS));
            ivec2 tap = pixel + ivec2(round(vec2(cos(angle), sin(angle)) * out_to));
            if (!inside(tap)) continue;
            SpecularTexel other = specular_texel_read(VIEW.images.fresh_specular, tap);
            if (other.frames == 0.0) continue;
            vec3 other_normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], tap).y);
            float weight = likeness(place, normal, own.roughness, place_read(tap), other_normal, other.roughness, tolerance);
            weight *= min(other.frames / own.frames, 4.0) * exp(-out_to * out_to / (radius * radius));
            sum += other.light * weight;
            total += weight;
        }
    }
    light_write(VIEW.images.specular_light, pixel, sum / total, dither(pixel, DITHER_SPECULAR));
}
