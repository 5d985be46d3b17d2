// Packed unit vectors: octahedral (Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors,
// 2014).
#ifndef RELIGHT_TRACE_DIRECTION_GLSL
#define RELIGHT_TRACE_DIRECTION_GLSL

vec2 octahedral(vec3 n) {
    vec2 p = n.xy / max(abs(n.x) + abs(n.y) + abs(n.z), 1.0e-20);
    if (n.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x >= 0.0 ? 1.0 : -1.0, p.y >= 0.0 ? 1.0 : -1.0);
    return p;
}

vec3 from_octahedral(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return normalize(n);
}

// In 2 x 16 bits: for surfaces.
uint pack_normal(vec3 n) { return packSnorm2x16(octahedral(n)); }

vec3 unpack_normal(uint packed) { return from_octahedral(unpackSnorm2x16(packed)); }

// Largest value of a signed 24-bit integer.
const float DIRECTION_STEPS = 8388607.0;

// In 2 x 24 bits, for rays: nearly the precision of the computed directions. Rays rounded to 2 x 16 bits hit surfaces
// that they should pass, and change the brightness of some pictures by a thousandth. `spare`: two numbers below 256.
uvec2 pack_direction(vec3 n, uvec2 spare) {
    ivec2 steps = ivec2(round(clamp(octahedral(n), -1.0, 1.0) * DIRECTION_STEPS));
    return uvec2(steps) << 8 | spare;
}

vec3 unpack_direction(uvec2 packed) { return from_octahedral(vec2(ivec2(packed) >> 8) / DIRECTION_STEPS); }

uvec2 spare_of_direction(uvec2 packed) { return packed & 255u; }

#endif
