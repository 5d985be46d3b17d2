#version 460
// Test of the gpu layer: a triangle fetched from a buffer.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Corners { vec3 at[]; };
layout(push_constant, scalar) uniform Push { Corners corners; vec4 color; };

void main() {
    gl_Position = vec4(corners.at[gl_VertexIndex], 1.0);
}
