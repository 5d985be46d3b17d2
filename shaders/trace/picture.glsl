// The finished linear picture, input of bloom, exposure and tone curve. It has the size of the view in the window,
// whatever the traced size.
#ifndef RELIGHT_TRACE_PICTURE_GLSL
#define RELIGHT_TRACE_PICTURE_GLSL

#include "trace/view.glsl"

ivec2 picture_size() { return ivec2(VIEW.antialias.output_width, VIEW.antialias.output_height); }

// Size of the grid of pixels that the histogram counts.
ivec2 histogram_size() { return (picture_size() + 1) / 2; }

vec3 picture_load(ivec2 pixel) {
    uint image = VIEW.antialias.image_picture;
    return (VIEW.flags & VIEW_ACCUMULATE) != 0 ? imageLoad(images_rgba32f[image], pixel).rgb : imageLoad(images_rgba16f[image], pixel).rgb;
}

// Writes a display-encoded colour to the target. In anaglyph stereo each eye writes its own channels.
void target_store(ivec2 target, vec3 color) {
    bool wide = VIEW.target.peak > 1.0;
    if (VIEW.target.channels != 7u) {
        bvec3 written = notEqual(uvec3(VIEW.target.channels) & uvec3(1, 2, 4), uvec3(0));
        vec3 before = wide ? imageLoad(images_rgba16f[VIEW.target.image], target).rgb : imageLoad(images_rgba8[VIEW.target.image], target).rgb;
        color = mix(before, color, written);
    }
    if (wide) imageStore(images_rgba16f[VIEW.target.image], target, vec4(color, 1.0));
    else imageStore(images_rgba8[VIEW.target.image], target, vec4(color, 1.0));
}

#endif
