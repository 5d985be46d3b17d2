#version 460
// A triangle that covers the viewport at one depth.
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push { vec4 color; float depth; } push;

void main() {
    gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, push.depth, 1.0);
}
