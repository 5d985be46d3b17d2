// Random numbers. The numbers of a pixel, pass and position in the pass form a low-discrepancy sequence over frames: of
// 2^k consecutive frames that begin at a multiple of 2^k, one lies in each interval of length 2^-k, and for pairs one
// in each box of that area with sides that are powers of two. Means over frames have less noise than with independent
// numbers, and the same expectation. The numbers depend on pixel, frame and pass alone, so that a frame can be repeated
// bit by bit.
//
// The sequences are Sobol's, two dimensions at a time, shuffled so that they are independent of each other, and
// scrambled (Burley, Practical Hash-based Owen Scrambling, JCGT 9(4), 2020). Hashes are PCG's (Jarzynski and Olano,
// Hash Functions for GPU Rendering, JCGT 9(3), 2020).
#ifndef RELIGHT_TRACE_RANDOM_GLSL
#define RELIGHT_TRACE_RANDOM_GLSL
#ifndef RANDOM_WITHOUT_VIEW
#include "trace/view.glsl"

// 1: the pixels share their sequences, each rotated by the pixel's blue noise, so that noise has no low frequencies
// over the picture (Georgiev and Fajardo, Blue-noise Dithered Sampling, SIGGRAPH 2016 Talks; in Deferred Hybrid Path
// Tracing, Ray Tracing Gems, 2019, section 26.4.1).
layout(constant_id = 6) const uint BLUE_NOISE = 0;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BlueNoiseTexels { float at[]; };
#else
const uint BLUE_NOISE = 0;
#endif

uint pcg_permute(uint state) {
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

uint pcg_step(uint state) { return state * 747796405u + 2891336453u; }

uint pcg_hash(uint x) { return pcg_permute(pcg_step(x)); }

uint rng_state; // of pixel and pass; one step for each sequence
uint rng_index; // frame index with reversed bits
uvec2 rng_pixel; // with blue noise

// `stream`: STREAM_*.
void rng_begin(uvec2 pixel, uint frame, uint stream) {
    if (BLUE_NOISE != 0) {
        rng_pixel = pixel;
        rng_state = pcg_hash(pcg_hash(stream));
    } else rng_state = pcg_hash(pixel.x + pcg_hash(pixel.y + pcg_hash(stream)));
    rng_index = bitfieldReverse(frame);
}

uint rng_seed() {
    rng_state = pcg_step(rng_state);
    return pcg_permute(rng_state);
}

// Owen scrambling of a number with reversed bits: whether a bit is flipped depends on the bits below it (Laine and
// Karras, Stratified Sampling for Stochastic Transparency, 2011; with Vegdahl's constants, which mix more evenly).
uint scramble(uint reversed, uint seed) {
    reversed ^= reversed * 0x3D20ADEAu;
    reversed += seed;
    reversed *= (seed >> 16u) | 1u;
    reversed ^= reversed * 0x05526C56u;
    reversed ^= reversed * 0x53A22864u;
    return reversed;
}

// Second Sobol dimension with reversed bits: the index as a polynomial over {0, 1}, evaluated at 1 + x in place of x.
// (1 + x)^2^k is 1 + x^2^k there, so halves of halves are added.
uint sobol_second(uint index) {
    index ^= index >> 16u;
    index ^= (index & 0xFF00FF00u) >> 8u;
    index ^= (index & 0xF0F0F0F0u) >> 4u;
    index ^= (index & 0xCCCCCCCCu) >> 2u;
    return index ^ (index & 0xAAAAAAAAu) >> 1u;
}

// Uniform in [0, 1): 24 bits, so that 1 never occurs.
float unit_float(uint bits) { return float(bits >> 8u) * (1.0 / 16777216.0); }

// A number of a sequence, as the pixel gets it; `seed`: of the dimension, which has a place of its own in the square.
float rotated(float x, uint seed) {
#ifndef RANDOM_WITHOUT_VIEW
    if (BLUE_NOISE != 0) {
        uvec2 place = (rng_pixel + uvec2(seed, seed >> 16u)) % BLUE_NOISE_SIZE;
        x = fract(x + BlueNoiseTexels(VIEW.blue_noise).at[place.y * BLUE_NOISE_SIZE + place.x]);
    }
#endif
    return x;
}

// The next number of one dimension: the first Sobol dimension is the index with reversed bits.
float rng_next() {
    uint index = bitfieldReverse(scramble(rng_index, rng_seed()));
    uint seed = rng_seed();
    return rotated(unit_float(bitfieldReverse(scramble(index, seed))), seed);
}

// The next numbers of two dimensions.
vec2 rng_next2() {
    uint index = bitfieldReverse(scramble(rng_index, rng_seed()));
    uint seed = rng_seed();
    float x = rotated(unit_float(bitfieldReverse(scramble(index, seed))), seed);
    seed = rng_seed();
    return vec2(x, rotated(unit_float(bitfieldReverse(scramble(sobol_second(index), seed))), seed));
}

// A number that is independent between frames, for uses that gain nothing from a sequence; a third of the cost.
float rng_independent() {
    uint seed = rng_seed() ^ rng_index;
    if (BLUE_NOISE != 0) seed ^= pcg_hash(rng_pixel.x + pcg_hash(rng_pixel.y));
    return unit_float(pcg_hash(seed));
}

// True with the probability `chance`. `u` decides and is uniform afterwards, so that one number makes several
// decisions, and evenly spread numbers are spread evenly over all outcomes.
bool rng_decide(inout float u, float chance) {
    bool happens = u < chance;
    u = min(happens ? u / chance : (u - chance) / (1.0 - chance), 1.0 - 1.0 / 16777216.0);
    return happens;
}

// One of `count`, each with the same probability; `u`: as above.
uint rng_pick(inout float u, uint count) {
    float at = u * float(count);
    uint picked = min(uint(at), count - 1);
    u = min(at - float(picked), 1.0 - 1.0 / 16777216.0);
    return picked;
}

#endif
