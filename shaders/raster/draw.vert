#version 460
// One draw of the classic look: fetches the vertex, evaluates the stage's colour and texture coordinates per vertex
// as the engine does. gl_InstanceIndex is the index of the Draw.
#include "raster/draw.glsl"

layout(location = 0) out vec4 out_color;
layout(location = 1) out vec4 out_uv;
layout(location = 2) out float out_clip;
layout(location = 3) out flat vec4 out_flat_color;
layout(location = 4) out flat uvec2 out_textures; // see `Draw`

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
    stage.tc_gen = i == 0 ? TC_GEN_0 : TC_GEN_1;
    if ((TC_MODS >> i & 1) != 0) return stage_texcoord(view.materials, stage, instance, point);
    stage.tc_mod_count = 0;
    vec2 st = stage_texcoord(view.materials, stage, instance, point);
    float m[6] = draw.texcoords[i];
    return vec2(st.x * m[0] + st.y * m[2] + m[4], st.x * m[1] + st.y * m[3] + m[5]);
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
    out_textures = uvec2(draw.textures[0], draw.textures[1]);
    out_flat_color = draw.color;
    out_color = vec4(1.0);
    out_uv = vec4(0.0);

    if (MODE == DRAW_LIGHT) {
        RasterLight light = RasterLights(view.lights).at[draw.light];
        // in the axes of the drawn entity, as the engine has it
        vec3 to = light.origin - world;
        mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
        vec3 delta = to * axis;
        out_uv.xy = 0.5 + delta.xy / light.radius;
        float height = abs(delta.z);
        float m = height > light.radius ? 0.0 : height < light.radius * 0.5 ? 1.0 : 2.0 * (light.radius - height) / light.radius;
        if (view.light_backs == 0 && dot(delta, vertex.normal) < 0.0) m = 0.0;
        out_color = vec4(light.color * m, 1.0);
    } else if (MODE == DRAW_FOG) {
        Fog fog = Fogs(view.fogs).at[draw.fog - 1];
        out_uv.xy = fog_coordinates(fog, view, world);
        out_flat_color = vec4(fog.color * view.identity_light, 1.0);
    } else {
        StagePoint point = StagePoint(vertex.position, vertex.normal, vertex.st, vertex.lightmap,
            unpackUnorm4x8(vertex.color), draw.time, view.identity_light, distance(view.eye, world));
        if (COLOR == COLOR_VERTEX) {
            Stage stage = Stages(view.materials.stages).at[draw.stages[0]];
            stage.rgb_gen = RGB_GEN;
            stage.alpha_gen = ALPHA_GEN;
            out_color = stage_color(view.materials, stage, instance, point);
            if (FOG_ADJUST != FOG_ADJUST_NONE) {
                float through = 1.0 - fog_factor(fog_coordinates(Fogs(view.fogs).at[draw.fog - 1], view, world));
                if (FOG_ADJUST != FOG_ADJUST_ALPHA) out_color.rgb *= through;
                if (FOG_ADJUST != FOG_ADJUST_RGB) out_color.a *= through;
            }
        }
        if ((TEXTURES & 1) != 0) out_uv.xy = texcoord(view, draw, instance, point, 0);
        if ((TEXTURES & 2) != 0) out_uv.zw = texcoord(view, draw, instance, point, 1);
    }
}
