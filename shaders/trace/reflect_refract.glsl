// Redirection of primary paths by portals, mirrors, reflecting stages, glass and liquids.
#ifndef RELIGHT_TRACE_REFLECT_REFRACT_GLSL
#define RELIGHT_TRACE_REFLECT_REFRACT_GLSL
#include "trace/path.glsl"
#include "trace/interface.glsl"
#include "trace/portal.glsl"

// `PATHS_*` number of paths that pass a portal after `paths`; `scene/turned.rs` numbers them the same way.
uint paths_through(uint paths, uint portal) {
    uint count = VIEW.scene.portal_count;
    bool pairs = PATHS_PORTAL + count + count * count <= PATHS_MOST;
    if (!pairs || paths < PATHS_PORTAL) return PATHS_PORTAL + portal <= 255u ? PATHS_PORTAL + portal : PATHS_DIRECT;
    uint last = paths - PATHS_PORTAL;
    if (last >= count) last = (last - count) % count;
    return PATHS_PORTAL + count + last * count + portal;
}

// Continues the path through a portal: mirrored, or from the far camera.
void pass_portal(inout Path path, SurfacePoint p, float t, uint index) {
    through_portal(Portals(VIEW.scene.portals).at[index], p.position, path.direction, path.origin);
    lit_plane = vec4(0.0);
    path.last = last_through(path.last, index);
    path.travelled += t;
    path.solid_mask = MASK_SOLID | MASK_THIRD_SOLID | paths_through(path.solid_mask >> PATHS_BIT, index) << PATHS_BIT;
    path.layer_mask = MASK_TRANSLUCENT | MASK_THIRD_TRANSLUCENT;
}

// Continues the path from a surface point at the distance `t`, on the side of `normal`.
void redirect_path(inout Path path, SurfacePoint p, float t, vec3 normal, vec3 direction) {
    path.origin = offset_ray(p.position, normal);
    path.direction = direction;
    path.travelled += t;
    path.layer_mask &= ~MASK_FIRST_TRANSLUCENT;
    path.events++;
    lit_plane = vec4(0.0);
}

// Continues the path mirrored. `face`: geometric normal on the path's side; `normal`: shading normal, distorted by
// `bend` (`BENT_*`).
void reflect_path(inout Path path, SurfacePoint p, float t, vec3 face, vec3 normal, uint bend) {
    vec3 mirrored = mirror_direction(path.direction, face, normal);
    path.last = last_reflected(path.last, vec4(face, dot(face, p.position)));
    if (normal != face) path.bent = max(path.bent, bend);
    redirect_path(path, p, t, face, mirrored);
    path.solid_mask |= MASK_SOLID | MASK_THIRD_SOLID;
    path.layer_mask = MASK_TRANSLUCENT | MASK_THIRD_TRANSLUCENT;
}

// Whether this run follows each split path to the other field's surface.
bool follows_other_side() { return push.number != 0; }

// Whether the path follows the reflection; `weight`: factor of the followed side. At the first such surface pixels
// alternate like a checkerboard, fixed over frames, and `composite` joins both fields; in reference mode a pixel
// alternates over frames. At later surfaces a random number decides, by the contribution of each side. In all cases the
// mean is the sum of both sides.
bool follows_reflection(inout Path path, float reflected, float rest, out float weight) {
    weight = 1.0;
    if (!(reflected >= MIN_REFLECTION)) return false;
    if (!(rest >= MIN_REFLECTION)) return true;
    if (path.field == 0) {
        bool accumulates = (VIEW.flags & VIEW_ACCUMULATE) != 0;
        uint parity = uint(LAUNCH_PIXEL.x) + uint(LAUNCH_PIXEL.y) + (accumulates ? VIEW.seed : 0u);
        path.field = 1u + ((parity + push.number) & 1u);
        weight = 2.0;
        return path.field == 2;
    }
    float chance = clamp(reflected / (reflected + rest), 0.1, 0.9);
    bool follows = rng_next() < chance;
    weight = 1.0 / (follows ? chance : 1.0 - chance);
    return follows;
}

// Handles a surface whose stages reflect; true if the path is mirrored.
bool pass_reflection(inout Path path, SurfacePoint p, Layer layer, float t) {
    vec3 face = dot(p.face_normal, path.direction) > 0.0 ? -p.face_normal : p.face_normal;
    vec3 normal = dot(p.normal, face) < 0.0 ? -p.normal : p.normal;
    float weight;
    float rest = min(max_component(layer.lit + layer.emission + layer.through), 1.0);
    if (follows_reflection(path, max_component(layer.reflected), rest, weight)) {
        NEEDS_RAYS(false)
        path.transmittance *= layer.reflected;
        path.weight *= weight;
        reflect_path(path, p, t, face, normal, BENT_BY_SHAPE);
        return true;
    }
    path.weight *= weight;
    return false;
}

// Handles the reflection of the surface; true if the path is mirrored.
bool pass_interface(inout Path path, SurfacePoint p, Interface i, SeenLayer seen, float t) {
    Layer layer = seen.linear;
    float mirrored = i.mirrored * seen.clear;
    vec3 reflected = mirrored + (1.0 - mirrored) * layer.reflected;
    float rest = (1.0 - mirrored) * min(max_component(layer.lit + layer.emission + layer.through), 1.0);
    float weight;
    bool follows = follows_reflection(path, max_component(reflected), rest, weight);
    path.transmittance *= follows ? reflected : vec3(1.0 - mirrored);
    path.weight *= weight;
    if (follows) reflect_path(path, p, t, i.face, i.normal, i.bend);
    return follows;
}

// Continues the path behind a frosted pane: it enters by the smooth face and leaves by the rough one.
void scatter_path(inout Path path, SurfacePoint p, Interface i, float t) {
    vec3 inside = refract(path.direction, i.face, 1.0 / i.eta);
    vec3 scattered = refract(inside, sample_facet(i.frost, i.face, -inside, rng_next2()), i.eta);
    // total reflection, or a direction back into the pane: it is scattered on until it leaves; here it passes straight
    if (dot(scattered, i.face) >= 0.0) scattered = path.direction;
    path.bent = max(path.bent, i.bend);
    redirect_path(path, p, t, -i.face, normalize(scattered));
}

// Continues the path refracted, on the other side of the surface of a liquid.
void refract_path(inout Path path, SurfacePoint p, Interface i, vec3 absorption, float t) {
    path.absorption = i.enters ? absorption : vec3(0.0);
    path.bent = max(path.bent, i.bend);
    redirect_path(path, p, t, -i.face, refracted_direction(path.direction, i));
}

#endif
