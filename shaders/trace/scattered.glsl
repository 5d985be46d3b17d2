// Rays of scattered light, which may meet cut-outs without a test of their alpha (`rt_cutouts`).
#ifndef RELIGHT_TRACE_SCATTERED_GLSL
#define RELIGHT_TRACE_SCATTERED_GLSL

#include "trace/random.glsl"
#include "trace/trace.glsl"

// The rays of this invocation are of scattered light; not those of mirrors and glossy surfaces.
bool rays_are_scattered = false;

// Where a ray that has met a cut-out, and passes it, leaves the box around it; -1: the hit is none, or stops the ray, with
// its coverage as probability (Memory-efficient Real-time Path Tracing for Computer Games, section 3.4).
float skipped_until(Hit hit, vec3 origin, vec3 direction) {
    if (hit.geometry == NO_HIT) return -1.0;
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    if (record.kind != KIND_TESTED) return -1.0;
    CutOut cut_out = cut_out_of(Triangles(record.triangles).at[hit.primitive]);
    if (cut_out.coverage <= 0.0 || rng_next() < cut_out.coverage) return -1.0;
    Instance instance = instance_of(record.instance);
    mat3 to_model = inverse(mat3(instance.axis[0], instance.axis[1], instance.axis[2]));
    vec3 from = to_model * (origin - instance.origin), way = to_model * direction;
    way = mix(way, vec3(1.0e-20), lessThan(abs(way), vec3(1.0e-20)));
    vec3 leaves = max((cut_out.mins - from) / way, (cut_out.maxs - from) / way);
    float end = max(min(leaves.x, min(leaves.y, leaves.z)), hit.t);
    return end + 1.0e-3 + 1.0e-5 * end;
}

// As `trace_ray`. With CUT_OUTS_SKIPPED a ray that passes a cut-out is traced again: within the box without cut-outs, and
// from there on as if they were solid, so that no ray skips two, nor a solid surface. A loop, because drivers inline
// functions.
Hit trace_scattered(vec3 origin, float tmin, vec3 direction, float tmax, uint mask, bool any_hit) {
    if (CUT_OUTS != 0 && rays_are_scattered) ray_cut_outs = VIEW.transport.cut_out_rays;
    bool skips = CUT_OUTS != 0 && ray_cut_outs == CUT_OUTS_SKIPPED;
    float from = tmin, to = tmax;
    Hit hit;
    for (uint leg = 0; leg < 3; leg++) {
        hit = trace_ray(origin, from, direction, to, mask, any_hit && (!skips || leg > 0));
        if (!skips || leg == 2) break;
        if (leg == 0) {
            float until = skipped_until(hit, origin, direction);
            if (until < 0.0) break;
            from = hit.t;
            to = min(until, tmax);
            ray_cut_outs = CUT_OUTS_OPEN;
        } else {
            if (hit.geometry != NO_HIT || to >= tmax) break;
            from = to;
            to = tmax;
            ray_cut_outs = CUT_OUTS_SKIPPED;
        }
    }
    ray_cut_outs = CUT_OUTS_TESTED;
    return hit;
}

#endif
