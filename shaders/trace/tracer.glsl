// Which tracer a ray generation shader is compiled for; include it first, before anything but `#version`. Each such
// file asks for its variants:
//
//     variants: COMPUTE=-DTRACER_COMPUTE -S comp     hierarchies of our own, in compute
//     variants: QUERY=-DTRACER_QUERY -S comp         ray queries, in compute
//     variants: NO_RAYS=-DTRACER_NONE -S comp        no rays at all: see no_rays.glsl
//
// Without a definition it is for the ray tracing pipeline.
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
