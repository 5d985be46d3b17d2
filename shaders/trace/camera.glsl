// Camera rays: the sample point in the pixel and on the lens. `rng_begin` must have been called (`random.glsl`).
#ifndef RELIGHT_TRACE_CAMERA_GLSL
#define RELIGHT_TRACE_CAMERA_GLSL

#include "trace/random.glsl"
#include "trace/view.glsl"

struct CameraRay {
    vec3 origin;
    vec3 direction;      // unit
    vec3 through_middle; // unit: through the centre of the lens
    float near;          // distance at which the ray passes the near plane
    vec2 seen;           // place in the picture, traced pixels from the left and top
};

// Direction of the ray through a place of the picture and the centre of the lens, of depth 1.
vec3 camera_direction(vec2 seen) {
    vec2 ndc = seen / vec2(VIEW.width, VIEW.height) * 2.0 - 1.0;
    ndc.x += VIEW.camera.stereo_shift;
    return VIEW.camera.forward - VIEW.camera.left * ndc.x - VIEW.camera.up * ndc.y;
}

// A thin lens (Kolb et al., A Realistic Camera Model for Computer Graphics, SIGGRAPH 1995, section 2, and Cook et al.,
// Distributed Ray Tracing, SIGGRAPH 1984): rays from all of a disc meet in the plane of focus; the disc is sampled
// uniformly by area.
CameraRay camera_ray(ivec2 pixel) {
    CameraRay ray;
    // one random number for each axis of the pixel's square
    vec2 place = (VIEW.flags & VIEW_JITTER) != 0 ? rng_next2() : vec2(0.5) + VIEW.antialias.jitter;
    ray.seen = vec2(pixel) + place;
    vec3 direction = camera_direction(ray.seen);
    ray.through_middle = normalize(direction);
    ray.origin = VIEW.camera.origin;
    ray.direction = ray.through_middle;
    if (VIEW.antialias.lens_radius > 0.0) {
        vec2 random = rng_next2();
        float radius = VIEW.antialias.lens_radius * sqrt(random.x), angle = 2.0 * PI * random.y;
        vec3 offset = (normalize(VIEW.camera.left) * cos(angle) + normalize(VIEW.camera.up) * sin(angle)) * radius;
        ray.origin += offset;
        ray.direction = normalize(direction * VIEW.antialias.focal_distance - offset);
    }
    ray.near = VIEW.camera.near / dot(ray.direction, VIEW.camera.forward);
    return ray;
}

#endif
