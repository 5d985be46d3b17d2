#version 460
// Reference mode: the running mean of the frames since anything changed replaces the frame.
#include "trace/view.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= int(VIEW.width) || pixel.y >= int(VIEW.height)) return;
    vec3 sum = imageLoad(images_rgba32f[VIEW.image_hdr], pixel).rgb;
    if (VIEW.accumulated > 0) sum += imageLoad(images_rgba32f[VIEW.image_accumulation], pixel).rgb;
    imageStore(images_rgba32f[VIEW.image_accumulation], pixel, vec4(sum, 1.0));
    imageStore(images_rgba32f[VIEW.image_hdr], pixel, vec4(sum / float(VIEW.accumulated + 1), 1.0));
}
