#version 460
// Marches the first ray of each path through the depth of the last frame. Where it passes behind a surface by less than
// the thickness of a pixel's surface, it hits; elsewhere the tracer follows it from the last point that lies in front of
// all surfaces around its pixel.
#include "trace/screen.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Greatest distance between samples, pixels: the march ends where this and `VIEW.screen.steps` samples do not reach.
const float MAX_STRIDE = 6.0;
const int REFINEMENTS = 5;

// The ray in the last frame's picture: x and y, both times the depth, and the depth, at the distance s: start + s * rate.
struct ScreenRay {
    vec3 origin;
    vec3 direction;
    vec3 normal; // of the surface that it leaves
    vec3 start;
    vec3 rate;
    float end; // distance at which it leaves the picture
};

vec3 projected(vec3 v) {
    CameraView camera = VIEW.last_camera;
    float depth = dot(v, camera.forward);
    return vec3(-dot(v, camera.left) / dot(camera.left, camera.left) - VIEW.camera.stereo_shift * depth,
        -dot(v, camera.up) / dot(camera.up, camera.up), depth);
}

// Where start + s * rate becomes negative.
float end_of(float start, float rate) { return start < 0.0 ? 0.0 : rate < 0.0 ? -start / rate : FAR; }

ScreenRay screen_ray(vec3 origin, vec3 direction, vec3 normal) {
    vec3 a = projected(origin - VIEW.last_camera.origin), b = projected(direction);
    float end = end_of(a.z - VIEW.camera.near, b.z);
    end = min(end, min(end_of(a.z - a.x, b.z - b.x), end_of(a.z + a.x, b.z + b.x)));
    end = min(end, min(end_of(a.z - a.y, b.z - b.y), end_of(a.z + a.y, b.z + b.y)));
    return ScreenRay(origin, direction, normal, a, b, end);
}

vec2 place_at(ScreenRay ray, float s) {
    vec3 at = ray.start + s * ray.rate;
    return (at.xy / at.z * 0.5 + 0.5) * vec2(VIEW.width, VIEW.height);
}

// Distance on the ray at a part of its way over the picture.
float distance_at(ScreenRay ray, float part) {
    float last = ray.start.z + ray.end * ray.rate.z;
    return ray.end * part * ray.start.z / mix(last, ray.start.z, part);
}

// A point of the ray against the surface in its pixel.
struct Sample {
    ivec2 pixel;
    float behind; // distance behind the surface; negative: in front
    float footprint; // width of the pixel there
    bool safe; // in front of the surfaces around the pixel too
    bool has_light;
};

Sample sample_at(ScreenRay ray, float s) {
    Sample found;
    found.pixel = clamp(ivec2(place_at(ray, s)), ivec2(0), ivec2(VIEW.width, VIEW.height) - 1);
    vec2 depth = screen_depth_read(found.pixel);
    found.has_light = depth.x > 0.0;
    depth.x = abs(depth.x);
    float away = distance(ray.origin + ray.direction * s, VIEW.last_camera.origin);
    found.behind = away - depth.x;
    found.safe = away < depth.y;
    found.footprint = depth.x * VIEW.camera.pixel_spread;
    // the surface that the ray leaves is not in its way, but rounding to pixels may say so
    float above = dot(screen_point(found.pixel, depth.x) - ray.origin, ray.normal);
    if (above < found.footprint + depth.x * (1.0 / 1024.0)) found.behind = min(found.behind, 0.0);
    return found;
}

Hit march(ScreenRay ray) {
    Hit none = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    if (!(ray.end > 0.0)) return none;
    vec2 way = abs(place_at(ray, ray.end) - place_at(ray, 0.0));
    float pixels = max(max(way.x, way.y), 1.0), most = float(VIEW.screen.steps);
    float stride = clamp(pixels / most, 1.0, MAX_STRIDE);
    float part_stride = stride / pixels, before = 0.0;
    float part = part_stride * rng_next();
    for (float i = 0.0; i < most && part < 1.0; i += 1.0) {
        float s = distance_at(ray, part);
        Sample found = sample_at(ray, s);
        if (found.behind > 0.0) {
            float near = before, far = part;
            for (int j = 0; j < REFINEMENTS; j++) {
                float middle = 0.5 * (near + far);
                Sample between = sample_at(ray, distance_at(ray, middle));
                if (between.behind > 0.0) {
                    far = middle;
                    found = between;
                } else near = middle;
            }
            bool hits = found.has_light && found.behind < VIEW.screen.thickness * found.footprint;
            return hits ? Hit(SCREEN_HIT, pack_place(found.pixel), vec2(0.0), distance_at(ray, far)) : none;
        }
        if (found.safe) none.t = s;
        before = part;
        part += part_stride;
    }
    return none;
}

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(cell, bounce_cells()))) return;
    ivec2 pixel = bounce_pixel(cell);
    if (any(greaterThanEqual(pixel, ivec2(VIEW.width, VIEW.height))) || starts_nothing(cell, pixel)) return;
    LightTask task = bounce_task(pixel);
    Hit hit = Hit(NO_HIT, 0, vec2(0.0), 0.0);
    vec3 direction;
    if (gathers(task)) {
        bounce_random(task, 0, BOUNCE_RAYS, path_stream());
        PathVertex v = first_vertex(task);
        if (bounce_direction(v, direction)) hit = march(screen_ray(vertex_origin(v), direction, v.face_normal));
    }
    screen_march_write(cell, hit);
}
