#version 460
// Shadow volumes only count in the stencil.
layout(location = 0) in float in_clip;

void main() {
    if (in_clip < 0.0) discard;
}
