// Portals and mirrors of the view.
#ifndef RELIGHT_TRACE_PORTAL_GLSL
#define RELIGHT_TRACE_PORTAL_GLSL

#include "trace/geometry.glsl"

// The portal that the surface belongs to, or `portal_count`.
uint portal_at(SurfacePoint p) {
    for (uint i = 0; i < VIEW.scene.portal_count; i++) {
        vec4 plane = Portals(VIEW.scene.portals).at[i].plane;
        if (abs(dot(plane.xyz, p.position) - plane.w) < 1.0 && abs(dot(plane.xyz, p.face_normal)) > 0.99) return i;
    }
    return VIEW.scene.portal_count;
}

// Continues a ray that meets the portal at `position`: mirrored, or from the far camera.
void through_portal(PortalRecord portal, vec3 position, inout vec3 direction, out vec3 origin) {
    if (portal.mirror != 0) {
        vec3 n = portal.plane.xyz;
        direction = normalize(direction - n * (2.0 * dot(n, direction)));
        origin = offset_ray(position, dot(n, direction) < 0.0 ? -n : n);
        return;
    }
    vec3 local = position - portal.surface_origin, turned = vec3(0.0);
    origin = portal.camera_origin;
    for (int i = 0; i < 3; i++) {
        origin += portal.camera_axis[i] * dot(local, portal.surface_axis[i]);
        turned += portal.camera_axis[i] * dot(direction, portal.surface_axis[i]);
    }
    direction = normalize(turned);
}

#endif
