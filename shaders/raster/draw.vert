#version 460
// A draw of the classic look: fetches the vertex and evaluates the stages' colours and texture coordinates per vertex,
// as the engine does. `gl_InstanceIndex` is the index of the `Draw`.
// variants: MANY=-DMANY_STAGES
// variants: MODIFIED=-DMANY_STAGES -DMODIFIED_TEXCOORDS
// variants: MAPPED=-DMANY_STAGES -DMODIFIED_TEXCOORDS -DSURFACE_MAPPING
// variants: HYBRID=-DMANY_STAGES -DMODIFIED_TEXCOORDS -DHYBRID
// variants: DEPTH=-DDEPTH_ALONE
#include "raster/draw.glsl"

// Pipelines that draw stages of one surface must compute equal depths.
invariant gl_Position;

layout(location = 2) out float out_clip;

#ifndef DEPTH_ALONE
// Only the elements that the draw's specialization constants use are written and read.
layout(location = 0) out vec4 out_uv[STAGE_PAIRS]; // two stages each
layout(location = 3) out flat uvec4 out_textures; // see `Draw`; with SURFACE_MAPPING or HYBRID, the index of the draw
layout(location = 4) out vec4 out_color[STAGES];
layout(location = 8) out flat vec4 out_flat_color[STAGES];
#ifdef SURFACE_MAPPING
// World space; in w the components of the vector to the viewer.
layout(location = 12) out vec4 out_normal;
layout(location = 13) out vec4 out_tangent;
layout(location = 14) out vec4 out_light;
#endif

// Fog texture coordinates of a point: s from the view depth, t from the depth below the fog's surface (engine's
// `RB_CalcFogTexCoords`).
vec2 fog_coordinates(uint number, vec3 world) {
    Fogs fogs = Fogs(VIEW.fogs);
    uint index = number - 1;
    vec3 camera = VIEW.origin;
    float s = dot(world - camera, VIEW.forward) / (8.0 * fogs.at[index].depth) + 1.0 / 512.0;
    float share = 1.0;
    if (fogs.at[index].has_surface != 0) {
        vec4 plane = fogs.at[index].plane;
        share = fog_share(dot(plane.xyz, world) - plane.w, dot(plane.xyz, camera) - plane.w);
    }
    float t = 1.0 / 32.0 + (30.0 / 32.0) * share;
    return vec2(s, t);
}

StagePoint stage_point(Draws draws, Vertices vertices, vec3 position, vec3 world) {
    return StagePoint(position, vertices.at[gl_VertexIndex].normal, vertices.at[gl_VertexIndex].st,
        vertices.at[gl_VertexIndex].lightmap, unpackUnorm4x8(vertices.at[gl_VertexIndex].color),
        draws.at[gl_InstanceIndex].time, VIEW.identity_light, distance(VIEW.origin, world));
}

// Texture coordinates of stage `i`; the draw holds what all vertices share.
vec2 texcoord(Draws draws, Instance instance, StagePoint point, uint i) {
    Stages stages = Stages(VIEW.materials.stages);
    uint index = draws.at[gl_InstanceIndex].stages[i];
    vec2 st = generated_texcoord(of_stage(TC_GEN, i), stages.at[index].vector_s, stages.at[index].vector_t, instance.viewer, point);
#ifdef MODIFIED_TEXCOORDS
    if ((TC_MODS >> i & 1) != 0) {
        mat2 jacobian = mat2(1.0);
        return modified_texcoord(VIEW.materials, stages.at[index].tc_mod_first, stages.at[index].tc_mod_count, instance.texcoord, point,
            st, jacobian);
    }
#endif
    float m[6] = draws.at[gl_InstanceIndex].texcoords[i];
    return vec2(st.x * m[0] + st.y * m[2] + m[4], st.x * m[1] + st.y * m[3] + m[5]);
}

void write_stage(Draws draws, Instance instance, StagePoint point, uint i) {
    if (of_stage(COLOR, i) != COLOR_WHITE) {
        vec4 color = draws.at[gl_InstanceIndex].colors[i];
        if (of_stage(COLOR, i) == COLOR_FLAT) {
            out_flat_color[i] = color;
        } else {
            float portal_range = Stages(VIEW.materials.stages).at[draws.at[gl_InstanceIndex].stages[i]].portal_range;
            out_color[i] = point_color(color, of_stage(RGB_GEN, i), of_stage(ALPHA_GEN, i), portal_range, instance, point);
#ifdef SURFACE_MAPPING
            // the fragment shader evaluates the light of the grid
            if ((MAPPING & MAPPING_SOURCE) == MAPPING_OF_GRID && i == TEXTURE_STAGE) out_color[i].rgb = vec3(1.0);
#endif
        }
    }
    if ((TEXTURES >> i & 1) == 0) return;
    vec2 uv = texcoord(draws, instance, point, i);
    if ((i & 1) == 0) out_uv[i / 2].xy = uv;
    else out_uv[i / 2].zw = uv;
}
#endif

#ifdef SURFACE_MAPPING
void write_mapping(Draws draws, mat3 axis, vec3 normal, vec3 world) {
    MappedVertex mapped = MappedVertex(vec3(0.0), normal);
    uint index = draws.at[gl_InstanceIndex].instance;
    if ((MAPPING & MAPPING_SOURCE) == MAPPING_OF_GRID) mapped.light = Instances(VIEW.instances).at[index].light_direction;
    else if (draws.at[gl_InstanceIndex].dynamic_vertices == 0 && VIEW.mapped_vertices != 0) mapped = MappedVertices(VIEW.mapped_vertices).at[gl_VertexIndex];
    vec3 to_viewer = VIEW.origin - world;
    out_normal = vec4(axis * normal, to_viewer.x);
    out_tangent = vec4(axis * mapped.tangent, to_viewer.y);
    out_light = vec4(axis * mapped.light, to_viewer.z);
    out_textures = uvec4(gl_InstanceIndex); // the draw has the textures
}
#endif

void main() {
    Draws draws = Draws(VIEW.draws);
    Vertices vertices = Vertices(draws.at[gl_InstanceIndex].dynamic_vertices != 0 ? VIEW.dynamic_vertices : VIEW.static_vertices);
    vec3 position = vertices.at[gl_VertexIndex].position;
    Instances instances = Instances(VIEW.instances);
    uint index = draws.at[gl_InstanceIndex].instance;
    mat3 axis = mat3(instances.at[index].axis[0], instances.at[index].axis[1], instances.at[index].axis[2]);
    vec3 world = axis[0] * position.x + axis[1] * position.y + axis[2] * position.z + instances.at[index].origin;
    gl_Position = mat4(VIEW.world_to_clip[0], VIEW.world_to_clip[1], VIEW.world_to_clip[2], VIEW.world_to_clip[3]) * vec4(world, 1.0);
    out_clip = CLIP != 0 ? dot(VIEW.clip_plane.xyz, world) - VIEW.clip_plane.w : 0.0;
#ifndef DEPTH_ALONE
#ifdef HYBRID
    out_textures = uvec4(gl_InstanceIndex); // the draw has the textures
#else
    out_textures = uvec4(draws.at[gl_InstanceIndex].textures[0], draws.at[gl_InstanceIndex].textures[1],
        draws.at[gl_InstanceIndex].textures[2], draws.at[gl_InstanceIndex].textures[3]);
#endif

    if (MODE == DRAW_LIGHT) {
        RasterLight light = RasterLights(VIEW.lights).at[draws.at[gl_InstanceIndex].light];
        // in the axes of the instance, as in the engine
        vec3 delta = (light.origin - world) * axis;
        out_uv[0].xy = 0.5 + delta.xy / light.radius;
        float height = abs(delta.z);
        float m = height > light.radius ? 0.0 : height < light.radius * 0.5 ? 1.0 : 2.0 * (light.radius - height) / light.radius;
        if (VIEW.light_backs == 0 && dot(delta, vertices.at[gl_VertexIndex].normal) < 0.0) m = 0.0;
        out_color[0] = vec4(light.color * m, 1.0);
    } else if (MODE == DRAW_PIXEL_LIGHT) {
#ifdef MANY_STAGES
        RasterLight light = RasterLights(VIEW.lights).at[draws.at[gl_InstanceIndex].light];
        uint fog = draws.at[gl_InstanceIndex].fog;
        vec2 in_fog = fog == 0 ? vec2(0.0) : fog_coordinates(fog, world);
        out_color[0] = vec4(light.origin - world, in_fog.x);
        out_color[1] = vec4(VIEW.origin - world, in_fog.y);
        out_color[2] = vec4(axis * vertices.at[gl_VertexIndex].normal, 0.0);
        vec4 parameters = draws.at[gl_InstanceIndex].colors[0];
        out_flat_color[0] = vec4(light.color * parameters.x, 1.0 / (light.radius * light.radius));
        out_flat_color[1] = parameters;
        if ((TEXTURES & 1) != 0) {
            out_uv[0].xy = texcoord(draws, instances.at[index], stage_point(draws, vertices, position, world), 0);
        }
#endif
    } else if (MODE == DRAW_FOG) {
        uint fog = draws.at[gl_InstanceIndex].fog;
        out_uv[0].xy = fog_coordinates(fog, world);
        out_flat_color[0] = vec4(Fogs(VIEW.fogs).at[fog - 1].color * VIEW.identity_light, 1.0);
    } else {
        Instance instance = instances.at[index];
        StagePoint point = stage_point(draws, vertices, position, world);
        // unrolled by hand, so that arguments are constant for every compiler
        write_stage(draws, instance, point, 0);
#ifdef MANY_STAGES
        write_stage(draws, instance, point, 1);
        write_stage(draws, instance, point, 2);
        write_stage(draws, instance, point, 3);
#endif
#ifdef SURFACE_MAPPING
        write_mapping(draws, axis, point.normal, world);
#endif
        if (FOG_ADJUST != FOG_ADJUST_NONE) {
            float through = 1.0 - fog_factor(fog_coordinates(draws.at[gl_InstanceIndex].fog, world));
            if (FOG_ADJUST != FOG_ADJUST_ALPHA) out_color[0].rgb *= through;
            if (FOG_ADJUST != FOG_ADJUST_RGB) out_color[0].a *= through;
        }
    }
#endif
}
