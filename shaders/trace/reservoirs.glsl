// Reservoirs of light samples, reused over frames and pixels (Bitterli et al., Spatiotemporal Reservoir Resampling for
// Real-Time Ray Tracing with Dynamic Direct Lighting, TOG 39(4), 2020).
//
// A sample is a light and the two random numbers of the point on it, so that all surfaces share one domain and reuse
// needs no Jacobian. A reservoir of the surface s has the property that, for any function g of the sample y, the mean of
// weight * g(y) is the sum over all lights of the integral of g over those numbers for which s receives light from y,
// shadows included. Joined reservoirs are weighted by multiple importance sampling, where surfaces that could not have
// produced the sample have no part: that makes the estimate unbiased (section 4.3), and costs a ray for each. The paper
// counts the surfaces that could have, with larger errors (docs/src/how/light-selection.md); here reservoirs share a sample in
// proportion to count and target: the balance heuristic of two frames, and pairwise of a pixel and each of its neighbours
// (Lin et al., Generalized Resampled Importance Sampling, TOG 41(4), 2022, section 7.1). A sample is selected by weights
// without shadows; the selected one has the exact weight. Selections use numbers that are independent between frames: those
// of a sequence over frames depend on the numbers that have selected the samples of the last frame.
#ifndef RELIGHT_TRACE_RESERVOIRS_GLSL
#define RELIGHT_TRACE_RESERVOIRS_GLSL

#include "trace/shadows.glsl"
#include "trace/denoise.glsl"

// Two texels a pixel: reservoir and geometric normal; position and normal.
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer ReservoirTexels { uvec4 at[]; };

// The last frame's reservoir counts as so many of this frame at most (section 5).
const float MOST_HISTORY = 20.0;
// Most samples that the counter of a reservoir holds.
const float MOST_COUNT = 31.0;
// Surfaces that differ more than this do not share samples: cosine of 25 degrees; part of the view distance.
const float LEAST_COSINE = 0.906308, MOST_DEPTH_CHANGE = 0.1;

struct Reservoir {
    uint light;
    vec2 u;       // of the point on the light, multiples of 2^-16 plus 2^-17
    float weight; // 0: no sample
    float count;  // number of samples that it stands for; 0: there is no surface
    bool sun;     // a sun may light the surface
};

// The surface that receives the light.
struct Receiver {
    vec3 position;
    vec3 face_normal;
    vec3 normal;
    bool first_person;
};

Receiver receiver_of(GBufferPixel g) { return Receiver(g.position, g.face_normal, g.normal, g.first_person); }

Reservoir no_reservoir() { return Reservoir(0, vec2(0.5), 0.0, 0.0, false); }

uvec2 numbers_of(vec2 u) { return min(uvec2(u * 65536.0), uvec2(65535u)); }
vec2 on_grid(vec2 u) { return (vec2(numbers_of(u)) + 0.5) / 65536.0; }

// Bits of the reservoir's third word below those of the weight.
const uint COUNT_BITS = 31u, FIRST_PERSON_BIT = 32u, SUN_BIT = 64u, LOW_BITS = 255u;

uvec4 pack_reservoir(Reservoir r, Receiver receiver) {
    uvec2 numbers = numbers_of(r.u);
    // 15 bits of the mantissa, rounded to nearest
    uint weight = floatBitsToUint(clamp(r.weight, 0.0, 1.0e30)) + 128u & ~LOW_BITS;
    uint low = uint(clamp(r.count, 0.0, MOST_COUNT)) | (receiver.first_person ? FIRST_PERSON_BIT : 0u) | (r.sun ? SUN_BIT : 0u);
    return uvec4(r.light, numbers.x | numbers.y << 16, weight | low, pack_normal(receiver.face_normal));
}

Reservoir unpack_reservoir(uvec4 packed) {
    vec2 u = (vec2(packed.y & 0xFFFFu, packed.y >> 16) + 0.5) / 65536.0;
    return Reservoir(packed.x, u, uintBitsToFloat(packed.z & ~LOW_BITS), float(packed.z & COUNT_BITS), (packed.z & SUN_BIT) != 0);
}

uint reservoir_place(ivec2 pixel) { return uint(pixel.y) * VIEW.width + uint(pixel.x); }

// The reservoirs of this frame, before those of neighbours are joined; their surfaces are in the G-buffer.
void reservoir_write(ivec2 pixel, Reservoir r, Receiver receiver) {
    ReservoirTexels(VIEW.scratch).at[reservoir_place(pixel)] = pack_reservoir(r, receiver);
}
Reservoir reservoir_read(ivec2 pixel) { return unpack_reservoir(ReservoirTexels(VIEW.scratch).at[reservoir_place(pixel)]); }

// The finished reservoirs, for the next frame.
void history_write(ivec2 pixel, Reservoir r, Receiver receiver) {
    if (VIEW.reservoirs.history == 0) return;
    ReservoirTexels history = ReservoirTexels(VIEW.reservoirs.history);
    uint place = 2 * reservoir_place(pixel);
    history.at[place] = pack_reservoir(r, receiver);
    history.at[place + 1] = uvec4(floatBitsToUint(receiver.position), pack_normal(receiver.normal));
}

Reservoir history_read(ivec2 pixel, out Receiver receiver) {
    ReservoirTexels history = ReservoirTexels(VIEW.reservoirs.history);
    uint place = 2 * reservoir_place(pixel);
    uvec4 first = history.at[place], second = history.at[place + 1];
    receiver = Receiver(uintBitsToFloat(second.xyz), unpack_normal(first.w), unpack_normal(second.w), (first.z & FIRST_PERSON_BIT) != 0);
    return unpack_reservoir(first);
}

// Whether the normals of two surfaces are alike enough that samples of one are good for the other.
bool alike(Receiver a, Receiver b) { return dot(a.normal, b.normal) >= LEAST_COSINE && a.first_person == b.first_person; }

// The unshadowed light of a sample at a surface, over the density of its numbers.
LightSample sample_at(Reservoir r, Receiver receiver) { return sample_light(r.light, receiver.position, receiver.normal, r.u); }

float sample_target(LightSample s) { return luminance(finite_light(s.light)); }

// The target of a sample at a surface, shadows included: in proportion to the probability that the surface produces it.
float arriving_target(Reservoir r, Receiver receiver) {
    LightSample s = sample_at(r, receiver);
    float target = sample_target(s);
    bool arrives = target > 0.0 && light_arrives(s, offset_ray(receiver.position, receiver.face_normal), shadow_mask(receiver.first_person));
    return arrives ? target : 0.0;
}

#endif
