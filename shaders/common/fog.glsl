// The engine's fog (`RB_CalcFogTexCoords`), used by both looks.
#ifndef RELIGHT_FOG_GLSL
#define RELIGHT_FOG_GLSL

// Fraction of the segment from the camera to a vertex that lies below the fog's surface. `below`, `camera_below`: depth of
// the vertex and of the camera below that surface, units.
float fog_share(float below, float camera_below) {
    if (camera_below < 0.0) return below < 1.0 ? 0.0 : below / (below - camera_below);
    return below < 0.0 ? 0.0 : 1.0;
}

#endif
