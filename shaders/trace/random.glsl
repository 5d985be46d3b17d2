// Random numbers: the PCG hash (Jarzynski and Olano, Hash Functions for GPU Rendering, JCGT 9(3), 2020), seeded by
// pixel, frame and pass, so that a frame can be made again bit by bit.
#ifndef RELIGHT_TRACE_RANDOM_GLSL
#define RELIGHT_TRACE_RANDOM_GLSL

uint pcg_hash(uint x) {
    uint state = x * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

uint rng_state;

void rng_begin(uvec2 pixel, uint frame, uint stream) {
    rng_state = pcg_hash(pixel.x + pcg_hash(pixel.y + pcg_hash(frame + pcg_hash(stream))));
}

// Uniform in [0, 1): 24 bits, so that 1 is never returned.
float rng_next() {
    rng_state = rng_state * 747796405u + 2891336453u;
    uint word = ((rng_state >> ((rng_state >> 28u) + 4u)) ^ rng_state) * 277803737u;
    return float(((word >> 22u) ^ word) >> 8) * (1.0 / 16777216.0);
}

vec2 rng_next2() {
    float a = rng_next();
    return vec2(a, rng_next());
}

#endif
