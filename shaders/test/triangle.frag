#version 460
// Test of the gpu layer: one colour.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Corners { vec3 at[]; };
layout(push_constant, scalar) uniform Push { Corners corners; vec4 color; };
layout(location = 0) out vec4 pixel;

void main() {
    pixel = color;
}
