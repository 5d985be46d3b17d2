#version 460
// Not run: uses every structure that GLSL and Rust share, so that the layout test finds them all in one module.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "generated/types.glsl"
#include "generated/trace_types.glsl"

layout(local_size_x = 1) in;

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer All {
    Vertex vertices[2]; Wave waves[2]; TcMod tc_mods[2]; Stage stages[2]; Material materials[2]; Instance instances[2];
    Triangle triangles[2]; Fog fogs[2]; MaterialBuffers material_buffers[2]; RasterView raster_views[2]; Draw draws[2];
    RasterLight raster_lights[2]; Flare flares[2]; FlareState flare_states[2]; GeometryRecord geometries[2]; TriangleLight triangle_lights[2]; SphereLight sphere_lights[2];
    SunLight suns[2]; BspNode nodes[2]; SkyRecord skies[2]; PortalRecord portals[2]; DenoiseView denoise_views[2]; TraceView trace_views[2];
    uint sum;
};
layout(push_constant, scalar) uniform Push { All all; };

void main() {
    all.sum = all.vertices[0].color + all.trace_views[1].width;
}
