// Included by every shader of the traced look: the push constant and the arrays that it refers to.
#ifndef RELIGHT_TRACE_VIEW_GLSL
#define RELIGHT_TRACE_VIEW_GLSL

#include "common/bindless.glsl"
#include "common/material.glsl"
#include "generated/trace_types.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer TraceViews { TraceView view; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Geometries { GeometryRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Triangles { Triangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TraceVertices { Vertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TraceInstances { Instance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TraceFogs { Fog at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Portals { PortalRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer MirrorPlanes { MirrorPlane at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BodyTriangles { BodyTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CutOuts { CutOut at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Skies { SkyRecord at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer TriangleLights { TriangleLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SphereLights { SphereLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SunLights { SunLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BspNodes { BspNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Integers { int at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Boxes { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Indices { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Positions { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Pairs { vec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer EmittedLights { EmittedLight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LastInstances { LastInstance at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightBoundsArray { LightBounds at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer LightSlots { LightSlot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightRows { LightRow at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DynamicRows { DynamicRow at[]; };

#if defined(FILTER_STEP)
layout(push_constant, scalar) uniform Push { FilterStep push; };
#elif defined(HYBRID_STEP)
layout(push_constant, scalar) uniform Push { HybridStep push; };
#elif defined(BAKE_STEP)
layout(push_constant, scalar) uniform Push { BakeStep push; };
#elif defined(FIRST_HITS_STEP)
layout(push_constant, scalar) uniform Push { FirstHitsStep push; };
#else
layout(push_constant, scalar) uniform Push { PassStep push; };
#endif
#ifdef HYBRID_STEP
uint64_t traced_view = push.view; // or `push.models`
#define VIEW (TraceViews(traced_view).view)
#else
#define VIEW (TraceViews(push.view).view)
#endif

// Index of a pixel's texel in a buffer.
uint place_of(ivec2 pixel) { return uint(pixel.y) * VIEW.width + uint(pixel.x); }

const float PI = 3.14159265358979;
// Beyond everything in a map, units (the engine's world ends at 131072).
const float FAR = 1.0e6;

#endif
