#version 460
// Moves records word by word: each that the CPU wrote to its place among those that stay on the GPU, or from their places
// those that a top level lists. One invocation for each 32-bit word.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "generated/trace_types.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Source { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Target { uint at[]; };
layout(push_constant, scalar) uniform Push { ListStep push; };

void main() {
    if (gl_GlobalInvocationID.x >= LIST_ROW) return;
    uint number = gl_GlobalInvocationID.y * LIST_ROW + gl_GlobalInvocationID.x;
    uint entry = number / push.words;
    if (entry >= push.count) return;
    uint word = number - entry * push.words;
    uint place = Source(push.places).at[entry];
    uint from = push.to_places != 0 ? entry : place;
    uint to = push.to_places != 0 ? place : entry;
    Target(push.target).at[to * push.words + word] = Source(push.source).at[from * push.words + word];
}
