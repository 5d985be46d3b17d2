#version 460
// Makes first hits of the image that the rasterizer has drawn.
#include "trace/first_hits.glsl"
#include "trace/camera.glsl"
#include "trace/count.glsl"
#include "trace/primary_hit.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= int(VIEW.width) || pixel.y >= int(VIEW.height)) return;
    uvec2 seen = imageLoad(uimages_rg32ui[push.image], pixel).xy;
    Hit hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    if (seen.x != 0) hit = hit_of_triangle(seen.x - 1, seen.y & ~PRIMARY_HIT_BITS, camera_ray(pixel).direction);
    primary_hit_write(pixel, hit, (seen.y & PRIMARY_HIT_FIRST_PERSON) != 0);
    count_rays(pixel, COUNT_PRIMARY_RAYS, true);
}
