#version 460
// One draw of the classic look: fetches the vertex, evaluates the stage's colour and texture coordinates per vertex
// as the engine does. gl_InstanceIndex is the index of the Draw.
#include "raster/draw.glsl"

layout(location = 0) out vec4 out_color;
layout(location = 1) out vec4 out_uv;
layout(location = 2) out float out_clip;
layout(location = 3) out flat uvec4 out_draw; // see draw.glsl

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

uint stage_texture(MaterialBuffers buffers, Stage stage, uint lightmap, float time) {
    return (stage.flags & STAGE_WHITE) != 0 ? NO_TEXTURE : stage_image(buffers, stage, lightmap, time);
}

void main() {
    RasterView view = Views(push.view).view;
    Draw draw = Draws(view.draws).at[gl_InstanceIndex];
    Vertex vertex = Vertices(draw.dynamic_vertices != 0 ? view.dynamic_vertices : view.static_vertices).at[gl_VertexIndex];
    Instance instance = Instances(view.instances).at[draw.instance];
    vec3 world = instance.axis[0] * vertex.position.x + instance.axis[1] * vertex.position.y
        + instance.axis[2] * vertex.position.z + instance.origin;
    gl_Position = mat4(view.world_to_clip[0], view.world_to_clip[1], view.world_to_clip[2], view.world_to_clip[3]) * vec4(world, 1.0);
    out_clip = dot(view.clip_plane.xyz, world) - view.clip_plane.w;
    out_draw = uvec4(NO_TEXTURE, NO_TEXTURE, 0, draw.mode);
    out_uv = vec4(0.0);
    vec4 color = unpackUnorm4x8(vertex.color);

    if (draw.mode == DRAW_STAGE) {
        Material material = Materials(view.materials.materials).at[draw.material];
        Stages stages = Stages(view.materials.stages);
        StagePoint point = StagePoint(vertex.position, vertex.normal, vertex.st, vertex.lightmap, color,
            shader_time(material, instance), view.identity_light, distance(view.eye, world));
        Stage first = stages.at[draw.stages[0]];
        out_color = stage_color(view.materials, first, instance, point);
        out_uv.xy = stage_texcoord(view.materials, first, instance, point);
        out_draw.x = stage_texture(view.materials, first, draw.lightmap, point.time);
        out_draw.z = first.sampler_index | first.alpha_func << 16 | draw.combine << 20;
        if (draw.stage_count > 1) {
            Stage second = stages.at[draw.stages[1]];
            out_uv.zw = stage_texcoord(view.materials, second, instance, point);
            out_draw.y = stage_texture(view.materials, second, draw.lightmap, point.time);
            out_draw.z |= second.sampler_index << 8;
        }
        if (draw.fog_adjust != FOG_ADJUST_NONE) {
            float through = 1.0 - fog_factor(fog_coordinates(Fogs(view.fogs).at[draw.fog - 1], view, world));
            if (draw.fog_adjust != FOG_ADJUST_ALPHA) out_color.rgb *= through;
            if (draw.fog_adjust != FOG_ADJUST_RGB) out_color.a *= through;
        }
    } else if (draw.mode == DRAW_LIGHT) {
        RasterLight light = RasterLights(view.lights).at[draw.argument];
        // in the axes of the drawn entity, as the engine has it
        vec3 to = light.origin - world;
        mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
        vec3 delta = to * axis;
        out_uv.xy = 0.5 + delta.xy / light.radius;
        float height = abs(delta.z);
        float m = height > light.radius ? 0.0 : height < light.radius * 0.5 ? 1.0 : 2.0 * (light.radius - height) / light.radius;
        out_color = vec4(light.color * m, 1.0);
    } else if (draw.mode == DRAW_FOG) {
        Fog fog = Fogs(view.fogs).at[draw.fog - 1];
        out_uv.xy = fog_coordinates(fog, view, world);
        out_color = vec4(fog.color * view.identity_light, 1.0);
    } else {
        bool lightmap = draw.mode == DRAW_LIGHTMAP;
        out_color = lightmap ? vec4(1.0) : color;
        out_uv.xy = lightmap ? vertex.lightmap : vertex.st;
        out_draw.x = draw.argument;
    }
}
