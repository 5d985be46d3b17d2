// Motion: where a pixel's surface was on the screen in the last frame, and its view distance then.
//
// A plane mirror shows a surface at its mirror image, and a portal shows it as if it stood behind the portal. Both are
// affine maps from a point to its virtual position. The map is composed along the path as it was in the last frame, so
// that motion is exact behind any chain of mirrors and portals, moved ones included (the virtual space of Zimmer et
// al., Path-space Motion Estimation and Decomposition for Robust Animation Filtering, EGSR 2015, section 5, for plane
// reflections). A texture moves with its surface: scrolling is no motion.
#ifndef RELIGHT_TRACE_MOTION_GLSL
#define RELIGHT_TRACE_MOTION_GLSL

#include "trace/camera.glsl"
#include "trace/geometry.glsl"
#include "trace/view_distance.glsl"

// Least offset of a surface that moves, pixels; 0 is reserved for surfaces at rest.
const float LEAST_OFFSET = 1.0e-3;

// The motion of a pixel.
struct Motion {
    vec2 offset;              // from the pixel to the surface's position in the last frame, pixels
    float last_view_distance; // view distance then; negative: unknown
    float mark;
};

Motion motion_read(ivec2 pixel) {
    vec4 v = imageLoad(images_rgba16f[VIEW.images.motion], pixel);
    return Motion(v.xy, v.z, v.w);
}

// Unit of the mark's fraction: largest amount of new light, relative to the light of the front.
const float MOST_FRESH = 8.0;

// Bias of the fraction of a pixel's colour that is new, so that the fraction can carry a sign.
const float LEAST_FRESH = 1.0 / 1024.0;

// The pixel's mark, in the fourth channel of the motion image. Integer part: the field of a checkerboard pixel
// (reflection 2, refraction 1), otherwise 0; plus 3 if the surface is seen through a curved or rippled one, so that its
// motion is approximate. Fraction: the light of layers in front that moves differently from the surface.
float mark_read(ivec2 pixel) { return imageLoad(images_rgba16f[VIEW.images.motion], pixel).w; }
float mark_of(uint field, bool bent, float new_part) { return float(field + (bent ? 3u : 0u)) + new_part; }
bool mark_bent(float mark) { return mark >= 3.0; }
float mark_field(float mark) { return floor(mark) - (mark_bent(mark) ? 3.0 : 0.0); }
float mark_new_part(float mark) { return (mark - floor(mark)) * MOST_FRESH; }

// Map from world space to the virtual space of the last frame's camera: x is seen at linear * x + translation.
struct LastSpace {
    mat3 linear;
    vec3 translation;
};

// Virtual position of a surface in the last frame.
struct LastPlace {
    vec4 at;             // w 1: a point; 0: a direction at infinity; -1: unknown
    float view_distance; // in this frame
    bool rests;           // the surface itself has not moved
};

LastSpace last_directly() { return LastSpace(mat3(1.0), vec3(0.0)); }
LastPlace last_nothing() { return LastPlace(vec4(0.0, 0.0, 0.0, -1.0), SKY_DISTANCE, false); }

// Composes with a plane that mirrored in the last frame; its reflection applies first.
LastSpace last_reflected(LastSpace space, vec4 plane) {
    vec3 n = plane.xyz;
    vec3 turned = space.linear * n;
    return LastSpace(space.linear - 2.0 * outerProduct(turned, n), space.translation + turned * (2.0 * plane.w));
}

// Composes with the portal or mirror of this index.
LastSpace last_through(LastSpace space, uint index) {
    PortalRecord portal = Portals(VIEW.motion.last_portals).at[index];
    if (portal.mirror != 0) return last_reflected(space, portal.plane);
    // from the far camera's space to that of the portal's surface
    mat3 to_surface = mat3(portal.surface_axis[0], portal.surface_axis[1], portal.surface_axis[2])
        * transpose(mat3(portal.camera_axis[0], portal.camera_axis[1], portal.camera_axis[2]));
    vec3 translation = portal.surface_origin - to_surface * portal.camera_origin;
    return LastSpace(space.linear * to_surface, space.linear * translation + space.translation);
}

// Position of the surface's point in the last frame, by its triangle's shape and instance then.
LastPlace last_place(LastSpace space, SurfacePoint p, float view_distance) {
    LastInstance instance = LastInstances(VIEW.motion.last_instances).at[p.instance];
    if (instance.known == LAST_UNKNOWN) return LastPlace(vec4(0.0, 0.0, 0.0, -1.0), view_distance, false);
    vec3 local = p.stage.position;
    // vertices that are written anew each frame have stored positions of the last frame
    uint64_t offset = p.vertices - VIEW.motion.vertices;
    if (p.vertices >= VIEW.motion.vertices && offset < VIEW.motion.vertex_bytes) {
        const uint vertex_size = 44u;
        uint base = uint(offset) / vertex_size;
        Positions last = Positions(VIEW.motion.last_positions);
        local = last.at[base + p.triangle.indices[0]] * p.weights.x + last.at[base + p.triangle.indices[1]] * p.weights.y
            + last.at[base + p.triangle.indices[2]] * p.weights.z;
    }
    bool same = instance.known == LAST_SAME && local == p.stage.position;
    vec3 world = p.position;
    if (!same) world = mat3(instance.axis[0], instance.axis[1], instance.axis[2]) * local + instance.origin;
    return LastPlace(vec4(space.linear * world + space.translation, 1.0), view_distance, same);
}

// The sky in a direction of this frame's path.
LastPlace last_sky(LastSpace space, vec3 direction) {
    return LastPlace(vec4(space.linear * direction, 0.0), SKY_DISTANCE, true);
}

// Offset, last view distance and view distance of a surface that a primary ray hit.
vec4 motion_of(CameraRay ray, LastPlace place) {
    float view_distance = min(place.view_distance, SKY_DISTANCE);
    if (place.at.w < 0.0 || (VIEW.flags & VIEW_HISTORY) == 0) return vec4(0.0, 0.0, -1.0, view_distance);
    if (place.rests && VIEW.motion.still != 0) return vec4(0.0, 0.0, view_distance, view_distance);
    // out of focus, a pixel also shows its neighbours' surfaces; the blur of a surface at rest moves like a point on
    // the central ray at its distance
    if (VIEW.antialias.lens_radius > 0.0 && place.rests && place.at.w > 0.0)
        place.at.xyz = VIEW.camera.origin + ray.through_middle * view_distance;
    vec3 v = place.at.xyz - VIEW.last_camera.origin * place.at.w;
    float depth = dot(v, VIEW.last_camera.forward);
    if (depth <= 0.0) return vec4(0.0, 0.0, -1.0, view_distance);
    vec2 ndc = -vec2(dot(v, VIEW.last_camera.left) / dot(VIEW.last_camera.left, VIEW.last_camera.left),
        dot(v, VIEW.last_camera.up) / dot(VIEW.last_camera.up, VIEW.last_camera.up)) / depth;
    ndc.x -= VIEW.camera.stereo_shift;
    vec2 offset = (ndc * 0.5 + 0.5) * vec2(VIEW.width, VIEW.height) - ray.seen;
    float last_view_distance = place.at.w > 0.0 ? min(length(v), SKY_DISTANCE) : SKY_DISTANCE;
    // offset 0 marks a surface at rest
    if (offset == vec2(0.0)) offset.x = LEAST_OFFSET;
    return vec4(clamp(offset, -60000.0, 60000.0), last_view_distance, view_distance);
}

// `motion`: result of `motion_of`.
void motion_write(ivec2 pixel, vec4 motion, float mark) {
    imageStore(images_rgba16f[VIEW.images.motion], pixel, vec4(motion.xy, as_half(motion.z), mark));
}

// Whether a surface of this motion rests in the picture.
bool rests_in_picture(vec4 motion) { return motion.xy == vec2(0.0) && motion.z >= 0.0; }

#endif
