#version 460
// Interpolates bounced light to the pixels that did not gather it: the mean of gathered neighbours on the same surface,
// weighted by distance. Bounced light changes slowly over a surface, and the denoiser smooths it over more than a
// pixel.
#include "trace/motion.glsl"
#include "trace/subsample.glsl"

const int TILE = 8, WIDE = TILE + 2;
layout(local_size_x = TILE, local_size_y = TILE) in;

// For the cells of the work group and those around it: the gathered pixel (x, y in 16 bits each), its light and normal,
// its position and view distance (negative: no surface).
shared uint gathered[WIDE * WIDE];
shared vec3 lights[WIDE * WIDE];
shared vec3 normals[WIDE * WIDE];
shared vec4 places[WIDE * WIDE];

void main() {
    ivec2 size = ivec2(VIEW.width, VIEW.height), cells = (size + CELL - 1) / CELL;
    ivec2 corner = ivec2(gl_WorkGroupID.xy) * TILE - 1;
    for (int i = int(gl_LocalInvocationIndex); i < WIDE * WIDE; i += TILE * TILE) {
        ivec2 cell = corner + ivec2(i % WIDE, i / WIDE);
        places[i] = vec4(-1.0);
        if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, cells))) continue;
        if (!is_selected(cell)) {
            gathered[i] = NOT_GATHERED;
            continue;
        }
        ivec2 pixel = subsample_pixel(cell);
        places[i] = place_read(pixel);
        gathered[i] = uint(pixel.x) | uint(pixel.y) << 16;
        lights[i] = light_read(VIEW.images.indirect, pixel);
        normals[i] = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).x);
    }
    barrier();
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(cell, cells))) return;
    int own = (int(gl_LocalInvocationID.y) + 1) * WIDE + int(gl_LocalInvocationID.x) + 1;
    for (int i = 0; i < CELL * CELL; i++) {
        ivec2 in_cell = ivec2(i & 1, i >> 1), pixel = cell * CELL + in_cell;
        bool is_own = gathered[own] == (uint(pixel.x) | uint(pixel.y) << 16);
        if (is_own || any(greaterThanEqual(pixel, size))) continue;
        vec4 position = place_read(pixel);
        vec3 light = vec3(0.0);
        bool found_some = true;
        if (position.w >= 0.0) {
            vec3 normal = unpack_normal(imageLoad(uimages_rg32ui[VIEW.images.surface], pixel).x);
            float tolerance = 0.1 + 6.0 * position.w * VIEW.camera.pixel_spread;
            // Pixels of the other field show another surface, so neighbours of the same field lie farther apart.
            bool takes_turns = mark_field(mark_read(pixel)) > 0.0;
            float reach = takes_turns ? 7.5 : 3.0;
            // fallback where no neighbour matches, as on a wire
            vec3 any_light = vec3(0.0);
            float weight = 0.0, any_weight = 0.0;
            for (int j = 0; j < 9; j++) {
                int at = own + (j / 3 - 1) * WIDE + j % 3 - 1;
                vec4 other = places[at];
                if (other.w < 0.0) continue;
                vec2 off = vec2(pixel - ivec2(gathered[at] & 0xFFFFu, gathered[at] >> 16));
                float near = max(reach - 0.75 * dot(off, off), 0.0);
                if (near == 0.0) continue;
                vec3 found = lights[at];
                any_light += found * near;
                any_weight += near;
                if (takes_turns && (int(off.x + off.y) & 1) != 0) continue;
                if (dot(normal, normals[at]) < 0.9 || abs(dot(other.xyz - position.xyz, normal)) > tolerance) continue;
                light += found * near;
                weight += near;
            }
            if (weight > 0.0) light /= weight;
            else if (ADAPTIVE != 0 && gathered[own] == NOT_GATHERED) found_some = false;
            else if (any_weight > 0.0) light = any_light / any_weight;
        }
        if (ADAPTIVE != 0 && !found_some) imageStore(uimages_r32ui[VIEW.images.indirect], pixel, uvec4(NOT_GATHERED));
        else light_write(VIEW.images.indirect, pixel, light, dither(pixel, DITHER_UPSAMPLED));
    }
}
