// Shared by the shaders of flares.
#extension GL_EXT_buffer_reference2 : require
#include "generated/types.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Flares { Flare at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer FlareStates { FlareState at[]; };
