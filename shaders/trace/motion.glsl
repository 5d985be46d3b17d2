// Motion: where the surface that a pixel shows was on the screen in the last frame, and how long the way to it was.
//
// What is seen in a plane mirror is seen at its mirror image, and what a portal shows is seen as if it stood behind the
// portal; both are affine maps from a point to where the eye takes it to be. The map is gradient_pixels along the path as it was
// in the last frame, so that motion is right behind any chain of mirrors and portals, moved ones included (the virtual
// space of Zimmer et al., Path-space Motion Estimation and Decomposition for Robust Animation Filtering, EGSR 2015,
// section 5, for plane reflections). What is on a texture moves with its surface: scrolling is no motion.
#ifndef RELIGHT_TRACE_MOTION_GLSL
#define RELIGHT_TRACE_MOTION_GLSL

#include "trace/camera.glsl"
#include "trace/geometry.glsl"

// Length of the way to the sky as the motion image holds it: beyond every map, within half floats.
const float SKY_DISTANCE = 60000.0;

// Pixels; less than this is nothing.
const float LEAST_OFFSET = 1.0e-3;

// The motion of a pixel.
struct Motion {
    vec2 offset;     // from the pixel to where its surface was in the last frame, pixels
    float last_view_distance; // length of the way to it then; negative: unknown
    float mark;
};

Motion motion_read(ivec2 pixel) {
    vec4 v = imageLoad(images_rgba16f[VIEW.images.motion], pixel);
    return Motion(v.xy, v.z, v.w);
}

// Most new light that a pixel tells of, times the light of its front: the unit of the fraction beside the field.
const float MOST_FRESH = 8.0;

// Added to the part of a pixel's colour that is new, so that it can have a sign.
const float LEAST_FRESH = 1.0 / 1024.0;

// The pixel's mark, which the motion image has room for: the field of a pixel that shows either a reflection (2) or what
// lies behind it (1), otherwise 0, and 3 more if it is seen bent, so that its motion is a guess; its fraction tells how much
// light of what is in front moves otherwise than the surface.
float mark_read(ivec2 pixel) { return imageLoad(images_rgba16f[VIEW.images.motion], pixel).w; }
float mark_of(uint field, bool bent, float new_part) { return float(field + (bent ? 3u : 0u)) + new_part; }
bool mark_bent(float mark) { return mark >= 3.0; }
float mark_field(float mark) { return floor(mark) - (mark_bent(mark) ? 3.0 : 0.0); }
float mark_new_part(float mark) { return (mark - floor(mark)) * MOST_FRESH; }

// Length of the way to what a pixel shows; SKY_DISTANCE: the sky.
float view_distance_read(ivec2 pixel) { return abs(imageLoad(images_r16f[VIEW.motion.view_distance], pixel).x); }

// The way to what a pixel showed in the last frame; negative if that did not rest in the picture.
float last_view_distance_read(ivec2 pixel) { return imageLoad(images_r16f[VIEW.motion.last_view_distance], pixel).x; }

// Where the eye of the last frame took points to be: x is seen at turn * x + shift.
struct LastSpace {
    mat3 linear;
    vec3 translation;
};

// A place in the last frame, as its eye saw it.
struct LastPlace {
    vec4 at;     // w 1: a point; 0: a direction at infinity; -1: nobody knows
    float view_distance;  // length of the way in this frame
    bool rests; // it has not moved itself
};

LastSpace last_directly() { return LastSpace(mat3(1.0), vec3(0.0)); }
LastPlace last_nothing() { return LastPlace(vec4(0.0, 0.0, 0.0, -1.0), SKY_DISTANCE, false); }

// A plane that mirrored in the last frame: what it shows is mirrored first.
LastSpace last_reflected(LastSpace space, vec4 plane) {
    vec3 n = plane.xyz;
    vec3 turned = space.linear * n;
    return LastSpace(space.linear - 2.0 * outerProduct(turned, n), space.translation + turned * (2.0 * plane.w));
}

// Behind the portal or mirror of this index.
LastSpace last_through(LastSpace space, uint index) {
    PortalRecord portal = Portals(VIEW.motion.last_portals).at[index];
    if (portal.mirror != 0) return last_reflected(space, portal.plane);
    // from what the far camera sees to the surface that shows it
    mat3 to_surface = mat3(portal.surface_axis[0], portal.surface_axis[1], portal.surface_axis[2])
        * transpose(mat3(portal.camera_axis[0], portal.camera_axis[1], portal.camera_axis[2]));
    vec3 translation = portal.surface_origin - to_surface * portal.camera_origin;
    return LastSpace(space.linear * to_surface, space.linear * translation + space.translation);
}

// Where the surface's point was in the last frame: its triangle as it was shaped and placed then.
LastPlace last_place(LastSpace space, SurfacePoint p, float view_distance) {
    LastInstance instance = LastInstances(VIEW.motion.last_instances).at[p.instance];
    if (instance.known == LAST_UNKNOWN) return LastPlace(vec4(0.0, 0.0, 0.0, -1.0), view_distance, false);
    vec3 local = p.stage.position;
    // geometry whose vertices are among those that are made anew each frame
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

// Offset, last path and path of a surface that a ray of the camera met.
vec4 motion_of(CameraRay ray, LastPlace place) {
    float view_distance = min(place.view_distance, SKY_DISTANCE);
    if (place.at.w < 0.0 || (VIEW.flags & VIEW_HISTORY) == 0) return vec4(0.0, 0.0, -1.0, view_distance);
    if (place.rests && VIEW.motion.still != 0) return vec4(0.0, 0.0, view_distance, view_distance);
    // out of focus, a pixel shows what lies beside it; the blur of what rests moves as a thing at its distance would
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
    // none at all is the mark of what rests
    if (offset == vec2(0.0)) offset.x = LEAST_OFFSET;
    return vec4(clamp(offset, -60000.0, 60000.0), last_view_distance, view_distance);
}

// `motion`: as `motion_of` makes it.
void motion_write(ivec2 pixel, vec4 motion, float mark) {
    imageStore(images_rgba16f[VIEW.images.motion], pixel, vec4(motion.xyz, mark));
    bool rests = motion.xy == vec2(0.0) && motion.z >= 0.0;
    imageStore(images_r16f[VIEW.motion.view_distance], pixel, vec4(rests ? motion.w : -motion.w));
}

#endif
