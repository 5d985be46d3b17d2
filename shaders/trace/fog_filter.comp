#version 460
// Filters the light in fog over cells with a similar amount of fog: light in the air changes slowly, the length of the
// visible segment does not.
#define FILTER_STEP
#include "trace/color.glsl"
#include "trace/light_image.glsl"
#include "trace/view.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Logarithm of the amount of fog that a cell shows.
float amount(ivec2 cell) {
    ivec2 pixel = min(cell * int(VIEW.fog.cell), ivec2(VIEW.width, VIEW.height) - 1);
    return log2(max(max_component(light_read(VIEW.fog.weight, pixel)), 1.0e-4));
}

bool shows_fog(ivec2 cell) {
    ivec2 first = cell * int(VIEW.fog.cell), end = ivec2(VIEW.width, VIEW.height);
    for (int y = first.y; y < min(first.y + int(VIEW.fog.cell), end.y); y++)
        for (int x = first.x; x < min(first.x + int(VIEW.fog.cell), end.x); x++)
            if (max_component(light_read(VIEW.fog.weight, ivec2(x, y))) > 0.0) return true;
    return false;
}

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(VIEW.fog.width, VIEW.fog.height);
    if (any(greaterThanEqual(cell, size))) return;
    // most of the picture shows no fog
    if (!shows_fog(cell)) {
        imageStore(images_rgba16f[uint(push.target)], cell, vec4(0.0));
        return;
    }
    float here = amount(cell);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int y = -2; y <= 2; y++) {
        for (int x = -2; x <= 2; x++) {
            ivec2 at = cell + ivec2(x, y) * int(push.spacing);
            if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
            vec4 light = imageLoad(images_rgba16f[uint(push.source)], at);
            if (!(light.a > 0.0)) continue;
            // binomial weights, reduced for a different amount of fog, increased for a mean over more frames
            const float binomial[3] = float[](6.0, 4.0, 1.0);
            float weight = binomial[abs(x)] * binomial[abs(y)] * exp2(-2.0 * abs(amount(at) - here)) * light.a;
            sum += light * weight;
            total += weight;
        }
    }
    imageStore(images_rgba16f[uint(push.target)], cell, total > 0.0 ? sum / total : vec4(0.0));
}
