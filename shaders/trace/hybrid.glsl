// Surfaces of the hybrid look, at half the picture's size.
#ifndef RELIGHT_TRACE_HYBRID_GLSL
#define RELIGHT_TRACE_HYBRID_GLSL

#include "trace/direction.glsl"
#include "trace/geometry.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer HybridViews { HybridView view; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer HybridTexels { HybridTexel at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer HybridReflections { HybridReflection at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RasterLights { RasterLight at[]; };

// Rays between surfaces, but for the first-person weapon.
const uint MASK_MODELS = MASK_SOLID | MASK_THIRD_SOLID;

#define HYBRID_VIEW (HybridViews(push.hybrid).view)

uint hybrid_place(ivec2 texel) { return uint(texel.y) * HYBRID_VIEW.width + uint(texel.x); }

bool hybrid_outside(ivec2 texel) {
    return texel.x < 0 || texel.y < 0 || texel.x >= int(HYBRID_VIEW.width) || texel.y >= int(HYBRID_VIEW.height);
}

vec3 hybrid_position(ivec2 texel, float inverse_depth) {
    vec2 at = vec2(texel);
    return HYBRID_VIEW.eye + (HYBRID_VIEW.corner + at.x * HYBRID_VIEW.right + at.y * HYBRID_VIEW.down) / inverse_depth;
}

// Tolerance of positions at a depth: rounding of the image, units.
float hybrid_slack(float inverse_depth) { return 0.05 + 2.0e-4 / inverse_depth; }

#endif
