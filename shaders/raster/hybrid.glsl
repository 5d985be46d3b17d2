// What rays found for a fragment of the hybrid look, from the four nearest texels of half the picture's size. Only
// texels of the fragment's plane count: 1 over the depth is linear on the screen along a plane, so its value at the
// texel is known. A fragment without such a texel has no shadow.

layout(constant_id = 14) const uint SHADOWED = 0; // bit i: models shadow the light of stage i; bit 4: of a dynamic light

layout(constant_id = 15) const uint MIRRORED = 0; // bit i: the environment image of stage i shows the scene

// Relative difference of depth from the plane.
const float SAME_PLANE = 0.01;

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer HybridViews { HybridView view; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer HybridTexels { HybridTexel at[]; };

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer HybridReflections { HybridReflection at[]; };

// The four nearest texels, with their weights if they lie in the fragment's plane.
struct HybridPlaces {
    ivec2 corner;
    vec2 share;
    ivec2 last;
    float here;
    vec2 slope;
};

HybridPlaces hybrid_places() {
    HybridPlaces p;
    p.here = gl_FragCoord.w;
    p.slope = vec2(dFdx(p.here), dFdy(p.here));
    vec2 at = gl_FragCoord.xy * 0.5 - 0.5;
    p.corner = ivec2(floor(at));
    p.share = at - floor(at);
    HybridViews views = HybridViews(push.hybrid);
    p.last = ivec2(views.view.width, views.view.height) - 1;
    return p;
}

ivec2 hybrid_place(HybridPlaces p, int i) { return clamp(p.corner + ivec2(i & 1, i >> 1), ivec2(0), p.last); }

uint hybrid_index(HybridPlaces p, ivec2 place) { return uint(place.y * (p.last.x + 1) + place.x); }

float hybrid_weight(HybridPlaces p, int i, float inverse_depth) {
    vec2 moved = (vec2(hybrid_place(p, i)) + 0.5) * 2.0 - gl_FragCoord.xy;
    if (abs(inverse_depth - (p.here + dot(p.slope, moved))) > SAME_PLANE * p.here) return 0.0;
    vec2 side = mix(1.0 - p.share, p.share, vec2(i & 1, i >> 1));
    return side.x * side.y + 1.0e-4;
}

// The part of the light of models' surroundings, or of dynamic light `light`, that is missing. Exactly 0 where all texels are.
float hybrid_shadow(HybridPlaces p, bool dynamic, uint light) {
    HybridTexels texels = HybridTexels(HybridViews(push.hybrid).view.texels);
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < 4; i++) {
        HybridTexel texel = texels.at[hybrid_index(p, hybrid_place(p, i))];
        float weight = hybrid_weight(p, i, texel.inverse_depth);
        sum += weight * (dynamic ? float(texel.occluded_lights >> light & 1u) : texel.occlusion);
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : 0.0;
}

// The mirrored scene as displayed, and 1 if it is known.
vec4 hybrid_reflection(HybridPlaces p) {
    HybridReflections reflections = HybridReflections(HybridViews(push.hybrid).view.reflections);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; i++) {
        HybridReflection texel = reflections.at[hybrid_index(p, hybrid_place(p, i))];
        sum += hybrid_weight(p, i, texel.inverse_depth) * vec4(unpackUnorm4x8(texel.color).rgb, 1.0);
    }
    return sum.a > 0.0 ? sum / sum.a : sum;
}

// An environment image shows surroundings of about this displayed brightness; a brighter mean is a tint.
const float USUAL_BRIGHTNESS = 1.0 / 3.0;

// The scene in place of an environment image whose mean is `mean`.
vec3 in_place_of(vec3 mean, vec3 scene) { return scene * min(mean / USUAL_BRIGHTNESS, 1.0); }
