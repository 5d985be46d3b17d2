// Shared by the shaders of shadow volumes.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Positions { vec3 at[]; };
layout(push_constant, scalar) uniform Push { mat4 world_to_clip; vec4 clip_plane; uint64_t positions; } push;
