#version 460
// Shadow volumes write the stencil only.
layout(location = 0) in float in_clip;

void main() {
    if (in_clip < 0.0) discard;
}
