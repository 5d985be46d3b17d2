#version 460
// Fills with one colour.
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push { vec4 color; float depth; } push;
layout(location = 0) out vec4 out_color;

void main() {
    out_color = push.color;
}
