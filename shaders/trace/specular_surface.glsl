// Specular reflection of the surface that a pixel shows, 16 bytes in `VIEW.images.specular`. Views without rough surfaces
// have no such image.
#ifndef RELIGHT_TRACE_SPECULAR_SURFACE_GLSL
#define RELIGHT_TRACE_SPECULAR_SURFACE_GLSL

#include "trace/direction.glsl"
#include "trace/light_image.glsl"
#include "trace/specular.glsl"

struct GlossPixel {
    Gloss gloss;
    // Specular albedo, with all that lies between camera and surface: the specular light S of the point, for a white
    // environment 1, shows as lobe_albedo * S.
    vec3 lobe_albedo;
    vec3 to_viewer; // from the surface along the path to the camera
    float hit_distance; // from the surface to what the pixel's path has hit; 0: unknown
};

const GlossPixel NO_GLOSS_PIXEL = GlossPixel(NO_GLOSS, vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0);

void gloss_write(ivec2 pixel, GlossPixel g) {
    uvec4 packed = uvec4(0);
    if (is_glossy(g.gloss)) packed = uvec4(pack_light(g.gloss.reflectance, 0.5), pack_light(g.lobe_albedo, 0.5), pack_normal(g.to_viewer), packHalf2x16(vec2(g.gloss.alpha, min(g.hit_distance, 60000.0))));
    imageStore(uimages_rgba32ui[VIEW.images.specular], pixel, packed);
}

GlossPixel gloss_read(ivec2 pixel) {
    uvec4 packed = imageLoad(uimages_rgba32ui[VIEW.images.specular], pixel);
    vec2 rest = unpackHalf2x16(packed.w);
    return GlossPixel(Gloss(unpack_light(packed.x), rest.x), unpack_light(packed.y), unpack_normal(packed.z), rest.y);
}

// What the specular light of the pixel adds to its radiance.
vec3 shown_gloss(ivec2 pixel) {
    if (HAS_GLOSS == 0) return vec3(0.0);
    vec3 lobe_albedo = unpack_light(imageLoad(uimages_rgba32ui[VIEW.images.specular], pixel).y);
    return lobe_albedo == vec3(0.0) ? vec3(0.0) : lobe_albedo * light_read(VIEW.images.specular_light, pixel);
}

#endif
