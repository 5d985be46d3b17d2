// The engine's fog (RB_CalcFogTexCoords), for both looks.
#ifndef RELIGHT_FOG_GLSL
#define RELIGHT_FOG_GLSL

// Of the way from the eye to a vertex, the part that lies in the fog, by how deep both are below the fog's surface.
float fog_share(float below, float eye_below) {
    if (eye_below < 0.0) return below < 1.0 ? 0.0 : below / (below - eye_below);
    return below < 0.0 ? 0.0 : 1.0;
}

#endif
