#version 460
// One draw of the classic look: fetches the vertex, evaluates the stages' colours and texture coordinates per vertex
// as the engine does. gl_InstanceIndex is the index of the Draw.
// variants: MANY=-DMANY_STAGES
#include "raster/draw.glsl"

// Of the arrays only what the draw's constants ask for is written, and read.
layout(location = 0) out vec4 out_uv[STAGES / 2]; // two stages each
layout(location = 2) out float out_clip;
layout(location = 3) out flat uvec4 out_textures; // see `Draw`
layout(location = 4) out vec4 out_color[STAGES];
layout(location = 8) out flat vec4 out_flat_color[STAGES];

// Stages of a surface are drawn where the depth is the same, by whichever pipelines.
invariant gl_Position;

// Fog texture coordinates of a point: s from the view depth, t from the depth below the fog's surface
// (engine's RB_CalcFogTexCoords; facts in the reference of the engine's behaviour).
vec2 fog_coordinates(Fog fog, RasterView view, vec3 world) {
    float s = dot(world - view.eye, view.forward) / (8.0 * fog.depth) + 1.0 / 512.0;
    float below = 1.0, eye_below = 1.0;
    bool outside = false;
    if (fog.has_surface != 0) {
        below = dot(fog.plane.xyz, world) - fog.plane.w;
        eye_below = dot(fog.plane.xyz, view.eye) - fog.plane.w;
        outside = eye_below < 0.0;
    }
    float t;
    if (outside) t = below < 1.0 ? 1.0 / 32.0 : 1.0 / 32.0 + (30.0 / 32.0) * below / (below - eye_below);
    else t = below < 0.0 ? 1.0 / 32.0 : 31.0 / 32.0;
    return vec2(s, t);
}

// Texture coordinates of stage `i`; what is the same for all vertices is in the draw.
vec2 texcoord(RasterView view, Draw draw, Instance instance, StagePoint point, uint i) {
    Stage stage = Stages(view.materials.stages).at[draw.stages[i]];
    stage.tc_gen = of_stage(TC_GEN, i);
    if ((TC_MODS >> i & 1) != 0) return stage_texcoord(view.materials, stage, instance, point);
    stage.tc_mod_count = 0;
    vec2 st = stage_texcoord(view.materials, stage, instance, point);
    float m[6] = draw.texcoords[i];
    return vec2(st.x * m[0] + st.y * m[2] + m[4], st.x * m[1] + st.y * m[3] + m[5]);
}

// Colour of stage `i` at a vertex.
vec4 vertex_color(RasterView view, Draw draw, Instance instance, StagePoint point, uint i) {
    Stage stage = Stages(view.materials.stages).at[draw.stages[i]];
    stage.rgb_gen = of_stage(RGB_GEN, i);
    stage.alpha_gen = of_stage(ALPHA_GEN, i);
    return stage_color(view.materials, stage, instance, point);
}

void write_stage(RasterView view, Draw draw, Instance instance, StagePoint point, uint i) {
    if (of_stage(COLOR, i) == COLOR_FLAT) out_flat_color[i] = draw.colors[i];
    if (of_stage(COLOR, i) == COLOR_VERTEX) out_color[i] = vertex_color(view, draw, instance, point, i);
    if ((TEXTURES >> i & 1) == 0) return;
    vec2 uv = texcoord(view, draw, instance, point, i);
    if ((i & 1) == 0) out_uv[i / 2].xy = uv;
    else out_uv[i / 2].zw = uv;
}

void main() {
    RasterView view = Views(push.view).view;
    Draw draw = Draws(view.draws).at[gl_InstanceIndex];
    Vertex vertex = Vertices(draw.dynamic_vertices != 0 ? view.dynamic_vertices : view.static_vertices).at[gl_VertexIndex];
    Instance instance = Instances(view.instances).at[draw.instance];
    vec3 world = instance.axis[0] * vertex.position.x + instance.axis[1] * vertex.position.y
        + instance.axis[2] * vertex.position.z + instance.origin;
    gl_Position = mat4(view.world_to_clip[0], view.world_to_clip[1], view.world_to_clip[2], view.world_to_clip[3]) * vec4(world, 1.0);
    out_clip = CLIP != 0 ? dot(view.clip_plane.xyz, world) - view.clip_plane.w : 0.0;
    if (MODE == DRAW_DEPTH) return;
    out_textures = uvec4(draw.textures[0], draw.textures[1], draw.textures[2], draw.textures[3]);

    if (MODE == DRAW_LIGHT) {
        RasterLight light = RasterLights(view.lights).at[draw.light];
        // in the axes of the drawn entity, as the engine has it
        vec3 to = light.origin - world;
        mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
        vec3 delta = to * axis;
        out_uv[0].xy = 0.5 + delta.xy / light.radius;
        float height = abs(delta.z);
        float m = height > light.radius ? 0.0 : height < light.radius * 0.5 ? 1.0 : 2.0 * (light.radius - height) / light.radius;
        if (view.light_backs == 0 && dot(delta, vertex.normal) < 0.0) m = 0.0;
        out_color[0] = vec4(light.color * m, 1.0);
    } else if (MODE == DRAW_FOG) {
        Fog fog = Fogs(view.fogs).at[draw.fog - 1];
        out_uv[0].xy = fog_coordinates(fog, view, world);
        out_flat_color[0] = vec4(fog.color * view.identity_light, 1.0);
    } else {
        StagePoint point = StagePoint(vertex.position, vertex.normal, vertex.st, vertex.lightmap,
            unpackUnorm4x8(vertex.color), draw.time, view.identity_light, distance(view.eye, world));
        // written out, so that every compiler sees the constants
        write_stage(view, draw, instance, point, 0);
        write_stage(view, draw, instance, point, 1);
#ifdef MANY_STAGES
        write_stage(view, draw, instance, point, 2);
        write_stage(view, draw, instance, point, 3);
#endif
        if (FOG_ADJUST != FOG_ADJUST_NONE) {
            float through = 1.0 - fog_factor(fog_coordinates(Fogs(view.fogs).at[draw.fog - 1], view, world));
            if (FOG_ADJUST != FOG_ADJUST_ALPHA) out_color[0].rgb *= through;
            if (FOG_ADJUST != FOG_ADJUST_RGB) out_color[0].a *= through;
        }
    }
}
