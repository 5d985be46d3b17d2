// Descriptor set 0, the only one, shared by all pipelines. The renderer's `gpu` module assigns the indices; an index
// that differs between invocations of a draw or dispatch needs `nonuniformEXT`. Shaders receive all other data as
// buffer device addresses in push constants.
//
// A shader that uses acceleration structures defines `BINDLESS_SCENES` and enables `GL_EXT_ray_tracing` or
// `GL_EXT_ray_query` before it includes this file.
#ifndef RELIGHT_BINDLESS_GLSL
#define RELIGHT_BINDLESS_GLSL

#extension GL_EXT_nonuniform_qualifier : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(set = 0, binding = 0) uniform sampler samplers[];
layout(set = 0, binding = 1) uniform texture2D textures[];
layout(set = 0, binding = 1) uniform utexture2D utextures[];

// Storage images: one binding, declared once per image format.
layout(set = 0, binding = 2, rgba8) uniform image2D images_rgba8[];
layout(set = 0, binding = 2, rgba16) uniform image2D images_rgba16[];
layout(set = 0, binding = 2, rgb10_a2) uniform image2D images_rgb10_a2[];
layout(set = 0, binding = 2, r11f_g11f_b10f) uniform image2D images_r11f_g11f_b10f[];
layout(set = 0, binding = 2, rgba16f) uniform image2D images_rgba16f[];
layout(set = 0, binding = 2, rg16f) uniform image2D images_rg16f[];
layout(set = 0, binding = 2, r16f) uniform image2D images_r16f[];
layout(set = 0, binding = 2, rgba32f) uniform image2D images_rgba32f[];
layout(set = 0, binding = 2, rg32f) uniform image2D images_rg32f[];
layout(set = 0, binding = 2, r32f) uniform image2D images_r32f[];
layout(set = 0, binding = 2, rgba32ui) uniform uimage2D uimages_rgba32ui[];
layout(set = 0, binding = 2, rg32ui) uniform uimage2D uimages_rg32ui[];
layout(set = 0, binding = 2, r32ui) uniform uimage2D uimages_r32ui[];
layout(set = 0, binding = 2, r16ui) uniform uimage2D uimages_r16ui[];

#ifdef BINDLESS_SCENES
layout(set = 0, binding = 3) uniform accelerationStructureEXT scenes[];
#endif

#endif
