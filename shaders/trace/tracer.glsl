// Selects the tracer of a ray generation shader. Must be the first include after `#version`. Each such file declares
// its variants:
//
//     variants: COMPUTE=-DTRACER_COMPUTE -S comp     own hierarchies, in compute
//     variants: GRID=-DTRACER_COMPUTE -DTRACER_GRID -S comp     the same, with a uniform grid for the map
//     variants: QUERY=-DTRACER_QUERY -S comp         ray queries, in compute
//     variants: NO_RAYS=-DTRACER_NONE -S comp        no rays: see no_rays.glsl
//
// Without a definition the shader is compiled for the ray tracing pipeline.
#ifndef RELIGHT_TRACE_TRACER_GLSL
#define RELIGHT_TRACE_TRACER_GLSL

#ifdef TRACER_QUERY
#extension GL_EXT_ray_query : require
#endif
#if !defined(TRACER_QUERY) && !defined(TRACER_COMPUTE) && !defined(TRACER_NONE)
#extension GL_EXT_ray_tracing : require
#endif
#if !defined(TRACER_COMPUTE) && !defined(TRACER_NONE)
#define BINDLESS_SCENES
#endif

#endif
