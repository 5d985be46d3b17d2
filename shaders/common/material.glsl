// Evaluates the stages of a material: waves, texture coordinates, colours. `shaderscript::eval` does the same on the
// CPU. The classic look evaluates stages per vertex, the traced look per hit. Colours are display-encoded, 0..1.
#ifndef RELIGHT_MATERIAL_GLSL
#define RELIGHT_MATERIAL_GLSL

#extension GL_EXT_buffer_reference2 : require
#include "generated/types.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Materials { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Stages { Stage at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TcMods { TcMod at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer ImageList { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer NoiseLattice { float values[256]; uint permutation[256]; };

// The point at which a stage is evaluated: a vertex or a hit, in the space of its instance.
struct StagePoint {
    vec3 position;
    vec3 normal;
    vec2 st;
    vec2 lightmap;
    vec4 color;          // of the vertex
    float time;          // shader time, seconds
    float identity_light;
    float view_distance; // from the camera, for `alphaGen portal`
};

// Values of the engine's sine table of 1024 entries.
vec2 table_sine(ivec2 index) { return sin(vec2(index & 1023) * (6.283185307 / 1023.0)); }

// Value of a wave. `turns`: periods. The engine's tables have 1024 entries.
float wave_table(uint function, float turns) {
    int index = int(turns * 1024.0) & 1023;
    switch (function) {
    case WAVE_SQUARE: return index < 512 ? 1.0 : -1.0;
    case WAVE_TRIANGLE: {
        int half_index = index & 511;
        float value = half_index < 256 ? float(half_index) / 256.0 : 1.0 - float(half_index - 256) / 256.0;
        return index < 512 ? value : -value;
    }
    case WAVE_SAWTOOTH: return float(index) / 1024.0;
    case WAVE_INVERSE_SAWTOOTH: return 1.0 - float(index) / 1024.0;
    default: return sin(float(index) * (6.283185307 / 1023.0));
    }
}

// The engine's 4D lattice noise at the spatial origin, as a function of time.
float noise_at_time(NoiseLattice lattice, float t) {
    float cell = floor(t);
    float fraction = t - cell;
    int i = int(cell);
    uint p0 = lattice.permutation[uint(i) & 255u];
    uint p1 = lattice.permutation[uint(i + 1) & 255u];
    // the spatial coordinates are 0: three permutations, as on the CPU
    for (int axis = 0; axis < 3; axis++) { p0 = lattice.permutation[p0 & 255u]; p1 = lattice.permutation[p1 & 255u]; }
    return mix(lattice.values[p0 & 255u], lattice.values[p1 & 255u], fraction);
}

// Returns phase + time * frequency. Removes whole periods first, so that hours of uptime keep their precision.
float wave_turns(float phase, float frequency, float time) {
    float turns = time * frequency;
    return phase + (turns - trunc(turns));
}

float wave_value(Wave wave, float time) {
    return wave.base + wave_table(wave.function, wave_turns(wave.phase, wave.frequency, time)) * wave.amplitude;
}

// Texture coordinates of `tcGen`, before any `tcMod`.
vec2 generated_texcoord(uint tc_gen, vec3 vector_s, vec3 vector_t, vec3 viewer, StagePoint p) {
    switch (tc_gen) {
    case TCGEN_LIGHTMAP: return p.lightmap;
    case TCGEN_ENVIRONMENT: {
        vec3 to_viewer = normalize(viewer - p.position);
        vec3 reflected = p.normal * (2.0 * dot(p.normal, to_viewer)) - to_viewer;
        return vec2(0.5 + 0.5 * reflected.y, 0.5 - 0.5 * reflected.z);
    }
    case TCGEN_VECTOR: return vec2(dot(p.position, vector_s), dot(p.position, vector_t));
    default: return p.st;
    }
}

// Applies `count` `tcMod`s in order. Multiplies `jacobian` by the derivative of each.
vec2 modified_texcoord(MaterialBuffers buffers, uint first, uint count, vec2 entity_texcoord, StagePoint p, vec2 st, inout mat2 jacobian) {
    TcMods mods = TcMods(buffers.tc_mods);
    for (uint i = first; i < first + count; i++) {
        mat2 m = mat2(1.0);
        vec2 offset = vec2(0.0);
        switch (mods.at[i].kind) {
        case TCMOD_TURBULENT: {
            Wave wave = mods.at[i].wave;
            float now = wave_turns(wave.phase, wave.frequency, p.time);
            offset = table_sine(ivec2((vec2(p.position.x + p.position.z, p.position.y) * (1.0 / 1024.0) + now) * 1024.0)) * wave.amplitude;
            break;
        }
        case TCMOD_SCALE: m = mat2(mods.at[i].values[0], 0.0, 0.0, mods.at[i].values[1]); break;
        case TCMOD_SCROLL: offset = fract(vec2(mods.at[i].values[0], mods.at[i].values[1]) * p.time); break;
        case TCMOD_STRETCH: {
            float scale = 1.0 / wave_value(mods.at[i].wave, p.time);
            m = mat2(scale);
            offset = vec2(0.5 - 0.5 * scale);
            break;
        }
        case TCMOD_TRANSFORM:
            m = mat2(mods.at[i].values[0], mods.at[i].values[1], mods.at[i].values[2], mods.at[i].values[3]);
            offset = vec2(mods.at[i].values[4], mods.at[i].values[5]);
            break;
        case TCMOD_ROTATE: {
            // the engine reads the angle from its sine table of 1024 entries
            float turns = -mods.at[i].values[0] * p.time / 360.0;
            int index = int(fract(turns) * 1024.0);
            vec2 sine = table_sine(ivec2(index, index + 256));
            float s = sine.x, c = sine.y;
            m = mat2(c, s, -s, c);
            offset = vec2(0.5 - 0.5 * c + 0.5 * s, 0.5 - 0.5 * s - 0.5 * c);
            break;
        }
        case TCMOD_ENTITY_TRANSLATE: offset = fract(entity_texcoord * p.time); break;
        }
        st = m * st + offset;
        jacobian = m * jacobian;
    }
    return st;
}

// Texture coordinates of the stage. `jacobian`: their derivative by the vertex's coordinates, without turbulence.
vec2 stage_texcoord(MaterialBuffers buffers, Stage stage, Instance instance, StagePoint p, out mat2 jacobian) {
    jacobian = mat2(1.0);
    vec2 st = generated_texcoord(stage.tc_gen, stage.vector_s, stage.vector_t, instance.viewer, p);
    return modified_texcoord(buffers, stage.tc_mod_first, stage.tc_mod_count, instance.texcoord, p, st, jacobian);
}

// Components of the stage's colour and alpha that are equal at all points; 1 for the other components.
vec4 flat_color(MaterialBuffers buffers, Stage stage, Instance instance, float time, float identity_light) {
    vec4 c = vec4(1.0);
    switch (stage.rgb_gen) {
    case RGBGEN_IDENTITY_LIGHTING: c.rgb = vec3(identity_light); break;
    case RGBGEN_WAVE:
        if (stage.rgb_wave.function == WAVE_NOISE) {
            float n = noise_at_time(NoiseLattice(buffers.noise), (time + stage.rgb_wave.phase) * stage.rgb_wave.frequency);
            c.rgb = vec3(stage.rgb_wave.base + n * stage.rgb_wave.amplitude);
        } else {
            c.rgb = vec3(wave_value(stage.rgb_wave, time) * identity_light);
        }
        break;
    case RGBGEN_CONST: c.rgb = stage.constant.rgb; break;
    case RGBGEN_ENTITY: c.rgb = instance.color.rgb; break;
    case RGBGEN_ONE_MINUS_ENTITY: c.rgb = 1.0 - instance.color.rgb; break;
    }
    switch (stage.alpha_gen) {
    case ALPHAGEN_CONST: c.a = stage.constant.a; break;
    case ALPHAGEN_WAVE: c.a = wave_value(stage.alpha_wave, time); break;
    case ALPHAGEN_ENTITY: c.a = instance.color.a; break;
    case ALPHAGEN_ONE_MINUS_ENTITY: c.a = 1.0 - instance.color.a; break;
    }
    return c;
}

// Multiplies in the components that differ between points, rounded to bytes as in the engine.
vec4 point_color(vec4 c, uint rgb_gen, uint alpha_gen, float portal_range, Instance instance, StagePoint p) {
    switch (rgb_gen) {
    case RGBGEN_VERTEX: c.rgb = p.color.rgb * p.identity_light; break;
    case RGBGEN_EXACT_VERTEX: c.rgb = p.color.rgb; break;
    case RGBGEN_ONE_MINUS_VERTEX: c.rgb = (1.0 - p.color.rgb) * p.identity_light; break;
    case RGBGEN_LIGHTING_DIFFUSE: {
        // an instance without the light grid has no such light
        bool lit = (instance.flags & INSTANCE_UNLIT) == 0;
        float incoming = max(dot(p.normal, instance.light_direction), 0.0);
        c.rgb = lit ? instance.ambient + incoming * instance.directed : vec3(0.0);
        if (alpha_gen == ALPHAGEN_IDENTITY && !lit) c.a = 0.0;
        break;
    }
    }
    switch (alpha_gen) {
    // unscaled vertex colours keep their alpha
    case ALPHAGEN_IDENTITY: if (rgb_gen == RGBGEN_VERTEX && p.identity_light == 1.0) c.a = p.color.a; break;
    case ALPHAGEN_VERTEX: c.a = p.color.a; break;
    case ALPHAGEN_ONE_MINUS_VERTEX: c.a = 1.0 - p.color.a; break;
    case ALPHAGEN_LIGHTING_SPECULAR: {
        bool own = (instance.flags & INSTANCE_OWN_SPECULAR) != 0;
        vec3 light = own ? instance.light_direction : normalize(vec3(-960.0, 1980.0, 96.0) - p.position);
        vec3 reflected = p.normal * (2.0 * dot(p.normal, light)) - light;
        float s = max(dot(reflected, normalize(instance.viewer - p.position)), 0.0);
        c.a = s * s * s * s;
        break;
    }
    case ALPHAGEN_PORTAL: c.a = p.view_distance / portal_range; break;
    }
    return floor(clamp(c, 0.0, 1.0) * 255.0 + 0.001) / 255.0;
}

// Colour and alpha by which the stage's image is multiplied.
vec4 stage_color(MaterialBuffers buffers, Stage stage, Instance instance, StagePoint p) {
    vec4 c = flat_color(buffers, stage, instance, p.time, p.identity_light);
    return point_color(c, stage.rgb_gen, stage.alpha_gen, stage.portal_range, instance, p);
}

// Bindless texture of the stage at this time. `lightmap`: lightmap page of the draw.
uint stage_image(MaterialBuffers buffers, Stage stage, uint lightmap, float time) {
    if (stage.image_count == 0) return lightmap;
    uint frame = 0;
    if (stage.image_count > 1) {
        float frames = max(floor(time * stage.image_frequency), 0.0);
        frame = uint(mod(frames, float(stage.image_count)));
    }
    return ImageList(buffers.images).at[stage.image_first + frame];
}

bool alpha_passes(uint alpha_func, float alpha) {
    switch (alpha_func) {
    case ALPHAFUNC_GT0: return alpha > 0.0;
    case ALPHAFUNC_LT128: return alpha < 0.5;
    case ALPHAFUNC_GE128: return alpha >= 0.5;
    default: return true;
    }
}

float shader_time(Material material, Instance instance) {
    return min(instance.time - material.time_offset, material.clamp_time);
}

#endif
