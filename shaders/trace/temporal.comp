#version 460
// First half of the denoiser: the light of this frame joins that of the frames before, where the surface that the pixel
// shows was in sight then (Schied et al., Spatiotemporal Variance-Guided Filtering, HPG 2017, section 4.1 and 4.2).
// Works on light without albedo, so textures stay sharp.
#include "trace/color.glsl"
#include "trace/gbuffer.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Least weight of a new frame: how fast changes of light come through.
const float MIN_WEIGHT = 0.06, MIN_MOMENT_WEIGHT = 0.15;
// Frames before the variance over time can be trusted; until then it is taken over space.
const float TRUSTED_FRAMES = 4.0;

bool inside(ivec2 pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < int(VIEW.width) && pixel.y < int(VIEW.height);
}

vec3 light_of(ivec2 pixel) {
    return imageLoad(images_rgba16f[VIEW.image_direct], pixel).rgb + imageLoad(images_rgba16f[VIEW.image_indirect], pixel).rgb;
}

// Pixel coordinates (middle of the first pixel: 0, 0) where the last frame saw the point.
vec2 last_pixel(vec3 position) {
    vec3 v = position - VIEW.last_eye;
    float depth = dot(v, VIEW.last_forward);
    if (depth <= 0.0) return vec2(-10.0);
    vec2 ndc = -vec2(dot(v, VIEW.last_left) / dot(VIEW.last_left, VIEW.last_left),
        dot(v, VIEW.last_up) / dot(VIEW.last_up, VIEW.last_up)) / depth;
    return (ndc * 0.5 + 0.5) * vec2(VIEW.width, VIEW.height) - 0.5;
}

// Whether the last frame's pixel shows the same surface.
bool same_surface(ivec2 pixel, GBufferPixel g) {
    vec4 last = imageLoad(images_rgba32f[VIEW.image_last_position], pixel);
    if (last.w < 0.0) return false;
    vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.image_last_surface], pixel).x);
    vec3 away = last.xyz - g.position;
    float footprint = g.path * VIEW.pixel_spread;
    return dot(normal, g.face_normal) > 0.9 && abs(dot(away, g.face_normal)) < 0.1 + 2.0 * footprint
        && dot(away, away) < 1.0 + 100.0 * footprint * footprint;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (!inside(pixel)) return;
    GBufferPixel g = gbuffer_read(pixel);
    if (g.path < 0.0) {
        imageStore(images_rgba16f[VIEW.image_filter], pixel, vec4(0.0));
        imageStore(images_rgba16f[VIEW.image_moments], pixel, vec4(0.0));
        return;
    }
    vec3 light = light_of(pixel);
    float value = luminance(light);

    // the last frame, by bilinear weights over the taps that show the same surface
    vec3 old_light = vec3(0.0);
    vec3 old_moments = vec3(0.0);
    float sum = 0.0;
    if ((VIEW.flags & VIEW_HISTORY) != 0) {
        vec2 place = last_pixel(g.position);
        vec2 low = floor(place), part = place - low;
        for (int i = 0; i < 4; i++) {
            ivec2 offset = ivec2(i & 1, i >> 1);
            ivec2 tap = ivec2(low) + offset;
            if (!inside(tap) || !same_surface(tap, g)) continue;
            float weight = (offset.x == 1 ? part.x : 1.0 - part.x) * (offset.y == 1 ? part.y : 1.0 - part.y);
            old_light += imageLoad(images_rgba16f[VIEW.image_last_light], tap).rgb * weight;
            old_moments += imageLoad(images_rgba16f[VIEW.image_last_moments], tap).rgb * weight;
            sum += weight;
        }
    }
    float frames = 0.0;
    vec2 moments = vec2(value, value * value);
    if (sum > 0.05) {
        old_light /= sum;
        old_moments /= sum;
        frames = old_moments.z;
        light = mix(old_light, light, max(1.0 / (frames + 1.0), MIN_WEIGHT));
        moments = mix(old_moments.xy, moments, max(1.0 / (frames + 1.0), MIN_MOMENT_WEIGHT));
    }
    frames = min(frames + 1.0, 64.0);

    float variance = max(moments.y - moments.x * moments.x, 0.0);
    if (frames < TRUSTED_FRAMES) {
        vec2 around = vec2(value, value * value);
        float count = 1.0;
        for (int y = -2; y <= 2; y++) {
            for (int x = -2; x <= 2; x++) {
                ivec2 tap = pixel + ivec2(x, y);
                if ((x == 0 && y == 0) || !inside(tap)) continue;
                vec4 position = imageLoad(images_rgba32f[VIEW.image_position], tap);
                if (position.w < 0.0 || abs(dot(position.xyz - g.position, g.face_normal)) > 0.1 + 4.0 * g.path * VIEW.pixel_spread) continue;
                float l = luminance(light_of(tap));
                around += vec2(l, l * l);
                count += 1.0;
            }
        }
        around /= count;
        variance = max(variance, max(around.y - around.x * around.x, 0.0));
    }
    // of the mean of the frames, not of one: what has settled is left as it is
    variance /= min(frames, (2.0 - MIN_WEIGHT) / MIN_WEIGHT);
    imageStore(images_rgba16f[VIEW.image_filter], pixel, vec4(light, min(variance, 60000.0)));
    imageStore(images_rgba16f[VIEW.image_moments], pixel, vec4(min(moments, vec2(60000.0)), frames, 0.0));
}
