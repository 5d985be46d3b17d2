#version 460
// Upscaling without history: Catmull-Rom, clamped to the range of the four nearest samples, so that edges are sharp
// without ringing. Works on compressed colours, as `antialias.comp` does.
#include "trace/color.glsl"
#include "trace/exposure.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float COMPRESSION = 0.25;

vec4 weights(float f) {
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2.0 - 1.5 * f)), f * f * (-0.5 + 0.5 * f));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 output_size = ivec2(VIEW.antialias.output_width, VIEW.antialias.output_height);
    if (any(greaterThanEqual(pixel, output_size))) return;
    ivec2 traced_size = ivec2(VIEW.width, VIEW.height);
    float exposure = COMPRESSION * max(ExposureState(VIEW.exposure.state).exposure, 1.0e-3) * exp2(VIEW.exposure.base + VIEW.exposure.bias);
    vec2 place = (vec2(pixel) + 0.5) * vec2(traced_size) / vec2(output_size) - 0.5 - VIEW.antialias.jitter;
    ivec2 low = ivec2(floor(place));
    vec4 across = weights(place.x - float(low.x)), down = weights(place.y - float(low.y));
    vec3 sum = vec3(0.0), least = vec3(1.0e30), most = vec3(0.0);
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            ivec2 at = clamp(low + ivec2(x, y) - 1, ivec2(0), traced_size - 1);
            vec3 c = imageLoad(images_rgba16f[VIEW.images.composite], at).rgb;
            c /= 1.0 + max_component(c) * exposure;
            sum += c * (across[x] * down[y]);
            if ((x == 1 || x == 2) && (y == 1 || y == 2)) {
                least = min(least, c);
                most = max(most, c);
            }
        }
    }
    vec3 color = clamp(sum, least, most);
    color /= max(1.0 - max_component(color) * exposure, 1.0e-3);
    imageStore(images_rgba16f[VIEW.antialias.image_resolved], pixel, vec4(min(color, vec3(60000.0)), 0.0));
}
