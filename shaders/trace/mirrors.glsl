// Surfaces that mirror bounced light: stages that represent reflections, mirrors and portals of the view, glass and
// liquids.
#ifndef RELIGHT_TRACE_MIRRORS_GLSL
#define RELIGHT_TRACE_MIRRORS_GLSL

#include "trace/layer.glsl"
#include "trace/portal.glsl"
#include "trace/dielectric.glsl"

// Weakest mirrored part that is followed.
const float MIN_MIRRORED = 1.0 / 256.0;

// Reflectance of glass or a liquid's surface on paths of bounced light; 0 for other layers. These paths pass both
// unrefracted, so both sides have the reflectance of the outer one, without total reflection.
float layer_reflectance(SurfacePoint p, vec3 direction) {
    Material material = material_of(p.triangle.material);
    if (!(material.dielectric.index > 0.0)) return 0.0;
    return dielectric_reflectance(material, p, abs(dot(p.face_normal, direction)), material.dielectric.index);
}

// The part of light that the point mirrors, by its stages. With the diffuse part it is at most all light.
vec3 mirrored_part(SurfacePoint p, vec3 direction, Layer layer) {
    if (p.kind == KIND_TRANSLUCENT) {
        float mirrored = layer_reflectance(p, direction);
        return min(mirrored + (1.0 - mirrored) * max(layer.reflected, 0.0), 1.0);
    }
    bool portal = (material_of(p.triangle.material).flags & MATERIAL_PORTAL) != 0 && portal_at(p) < VIEW.scene.portal_count;
    vec3 mirrored = portal ? layer.through : layer.reflected;
    return clamp(mirrored, vec3(0.0), 1.0 - clamp(layer.lit, 0.0, 1.0));
}

// Index of the flat mirror that the surface belongs to; not below `mirror_count`: light is not sampled across it.
uint mirror_of(SurfacePoint p) {
    if (VIEW.transport.mirror_count == 0 || (p.triangle.flags & TRIANGLE_STATIC) == 0) return NO_MIRROR;
    return Indices(VIEW.transport.mirror_of_surface).at[p.triangle.instance];
}

// Whether light is sampled across the surface: it is a flat mirror of the map, and no portal to another place.
bool is_sampled_mirror(SurfacePoint p) {
    if (mirror_of(p) >= VIEW.transport.mirror_count) return false;
    if ((material_of(p.triangle.material).flags & MATERIAL_PORTAL) == 0) return true;
    uint portal = portal_at(p);
    return portal == VIEW.scene.portal_count || Portals(VIEW.scene.portals).at[portal].mirror != 0;
}

// The ray that continues one of the direction `direction`. `face`, `normal`: on the side that it comes from.
void mirror_ray(SurfacePoint p, vec3 face, vec3 normal, vec3 direction, out vec3 origin, out vec3 mirrored) {
    if ((material_of(p.triangle.material).flags & MATERIAL_PORTAL) != 0) {
        uint portal = portal_at(p);
        if (portal < VIEW.scene.portal_count) {
            mirrored = direction;
            through_portal(Portals(VIEW.scene.portals).at[portal], p.position, mirrored, origin);
            return;
        }
    }
    if (mirror_of(p) < VIEW.transport.mirror_count) normal = face;
    mirrored = mirror_direction(direction, face, normal);
    origin = offset_ray(p.position, face);
}

#endif
