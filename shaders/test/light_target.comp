#version 460
// Test of the target function of light sampling, which the CPU repeats for the chances of lights.
#define FILTER_STEP
#include "trace/lights.glsl"

layout(local_size_x = 64) in;

struct Query { vec3 position; vec3 normal; uint light; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Queries { Query at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Results { float at[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.spacing) return;
    Query query = Queries(push.source).at[index];
    Results(push.target).at[index] = light_target(query.light, query.position, query.normal);
}
