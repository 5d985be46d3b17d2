// What rays found for a fragment of the hybrid look, from the four nearest texels of half the picture's size. Only
// texels of the fragment's plane count: 1 over the depth is linear on the screen along a plane, so its value at the
// texel is known. A fragment without such a texel has no shadow.

layout(constant_id = 14) const uint SHADOWED = 0; // bit i: models shadow the light of stage i; bit 4: of a dynamic light

// Relative difference of depth from the plane.
const float SAME_PLANE = 0.01;

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer HybridViews { HybridView view; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer HybridTexels { HybridTexel at[]; };

// Parts of the light of models' surroundings and of dynamic light `light` that are missing. Exactly 0 where all texels are.
float hybrid_shadow(bool dynamic, uint light) {
    float here = gl_FragCoord.w;
    vec2 slope = vec2(dFdx(here), dFdy(here));
    HybridViews views = HybridViews(push.hybrid);
    HybridTexels texels = HybridTexels(views.view.texels);
    ivec2 last = ivec2(views.view.width, views.view.height) - 1;
    vec2 at = gl_FragCoord.xy * 0.5 - 0.5;
    vec2 corner = floor(at), share = at - corner;
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 offset = ivec2(i & 1, i >> 1);
        ivec2 place = clamp(ivec2(corner) + offset, ivec2(0), last);
        HybridTexel texel = texels.at[place.y * int(views.view.width) + place.x];
        vec2 moved = (vec2(place) + 0.5) * 2.0 - gl_FragCoord.xy;
        float expected = here + dot(slope, moved);
        if (abs(texel.inverse_depth - expected) > SAME_PLANE * here) continue;
        vec2 side = mix(1.0 - share, share, vec2(offset));
        float weight = side.x * side.y + 1.0e-4;
        sum += weight * (dynamic ? float(texel.hidden >> light & 1u) : texel.occlusion);
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
}
