#version 460
// From linear radiance to the displayed picture: bloom, exposure, tone curve, display encoding.
#include "trace/bloom.glsl"
#include "trace/exposure.glsl"
#include "trace/picture.glsl"
#include "trace/tone_curve.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// The bloom at a pixel, interpolated between its texels.
vec3 bloom_at(ivec2 pixel) {
    uint start = bloom_start(BLOOM_LEVELS);
    ivec2 size = bloom_size(0);
    vec2 at = (vec2(pixel) + 0.5) / float(BLOOM_FIRST) - 0.5;
    ivec2 low = ivec2(floor(at));
    vec2 part = at - vec2(low);
    vec3 above = mix(bloom_read(start, size, low), bloom_read(start, size, low + ivec2(1, 0)), part.x);
    vec3 below = mix(bloom_read(start, size, low + ivec2(0, 1)), bloom_read(start, size, low + ivec2(1, 1)), part.x);
    return mix(above, below, part.y);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, picture_size()))) return;
    ivec2 target = pixel + ivec2(VIEW.target.x, VIEW.target.y);
    if (target.x < 0 || target.y < 0 || target.x >= int(VIEW.target.width) || target.y >= int(VIEW.target.height)) return;
    float exposure = ExposureState(VIEW.exposure.state).exposure * exp2(VIEW.exposure.base + VIEW.exposure.bias);
    vec3 radiance = picture_load(pixel);
    if (VIEW.post.bloom != 0) radiance = mix(radiance, bloom_at(pixel), VIEW.post.bloom_strength);
    radiance = max(radiance * exposure, 0.0);
    vec3 shown = VIEW.target.peak > 1.0 ? tone_curve_to(radiance, VIEW.target.peak) : tone_curve(radiance);
    target_store(target, encode_display(shown));
}
