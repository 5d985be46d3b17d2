#version 460
// `rt_debug`: an intermediate result in place of the picture. `docs/src/settings/views.md` explains the colours.
#include "trace/lights.glsl"
#include "trace/denoise.glsl"
#include "trace/camera.glsl"
#include "trace/motion.glsl"
#include "trace/picture.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer TimeSums { uint at[]; };

// Sums of doublings are integers of this fraction: 2^32 hold those of 16 million pixels.
const float TIME_SUM_SCALE = 8.0;

layout(local_size_x = 8, local_size_y = 8) in;

const vec3 NOTHING = vec3(0.1, 0.1, 0.1);

// Colour scale: 0 black, then blue, cyan, green, yellow, red, 1 white, in steps of 1/6.
vec3 heat(float t) {
    const vec3 COLORS[7] = vec3[](vec3(0, 0, 0), vec3(0.1, 0.15, 0.9), vec3(0, 0.75, 0.9), vec3(0.1, 0.75, 0.15),
        vec3(0.95, 0.9, 0.1), vec3(0.9, 0.1, 0.05), vec3(1, 1, 1));
    float place = clamp(t, 0.0, 1.0) * 6.0;
    uint index = min(uint(place), 5u);
    return mix(COLORS[index], COLORS[index + 1], place - float(index));
}

// A count as `heat`: one step for each doubling of 1 + count; 2^steps is white.
vec3 heat_count(float count, float steps) { return heat(log2(1.0 + count) / steps); }

// Ticks of a pixel as `heat` beside the mean of their logarithms in the last frame: green is the mean, a step is a factor
// of 2. Pixels of a cell share their time, because one of them gathers bounced light.
vec3 heat_time(ivec2 pixel) {
    if (VIEW.post.image_time == NO_IMAGE) return NOTHING;
    ivec2 size = ivec2(VIEW.width, VIEW.height);
    float ticks = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 place = min((pixel & ~1) + ivec2(i & 1, i >> 1), size - 1);
        ticks += float(imageLoad(uimages_r32ui[VIEW.post.image_time], place).x) / float(4 * TIMED_FRAMES);
    }
    float doublings = log2(1.0 + ticks);
    TimeSums sums = TimeSums(VIEW.post.time_sums);
    atomicAdd(sums.at[2 * VIEW.post.time_turn], uint(doublings * TIME_SUM_SCALE + 0.5));
    atomicAdd(sums.at[2 * VIEW.post.time_turn + 1], 1u);
    uint before = 2 * (1 - VIEW.post.time_turn);
    if (sums.at[before + 1] == 0) return NOTHING;
    float mean = float(sums.at[before]) / (TIME_SUM_SCALE * float(sums.at[before + 1]));
    return heat((doublings - mean) / 6.0 + 0.5);
}

// Colour of an angle, full circle.
vec3 hue(float angle) {
    vec3 shift = vec3(0.0, 2.0 / 3.0, 1.0 / 3.0);
    return clamp(abs(fract(angle / (2.0 * PI) + shift) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

vec3 cluster_color(uint cluster, vec3 normal) {
    if (cluster == VIEW.lights.cell_count) return vec3(0.5 + 0.3 * normal.z);
    uint x = cluster * 0x9E3779B1u;
    x ^= x >> 15;
    x *= 0x2C1B3C6Du;
    x ^= x >> 13;
    // shading by direction keeps the geometry recognizable
    float shade = 0.75 + 0.15 * normal.z + 0.1 * normal.x;
    return mix(vec3(1.0), hue(float(x & 0xFFFFu) / 65536.0 * 2.0 * PI), 0.45 + 0.5 * float(x >> 16) / 65536.0) * shade;
}

// Green: reflected; blue: behind the reflecting surface; white: seen in a mirror or portal, or refracted.
vec3 specular_color(ivec2 pixel, GBufferPixel g) {
    float field = mark_field(mark_read(pixel));
    if (field > 0.0) return field == 2.0 ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
    if (g.view_distance < 0.0) return vec3(0.0);
    rng_begin(uvec2(pixel), VIEW.seed, STREAM_PRIMARY);
    CameraRay ray = camera_ray(pixel);
    return distance(ray.origin + ray.direction * g.view_distance, g.position) > 0.1 + 0.01 * g.view_distance ? vec3(1.0) : vec3(0.0);
}

vec3 debug_color(ivec2 pixel) {
    GBufferPixel g = gbuffer_read(pixel);
    bool is_lit = g.view_distance >= 0.0;
    switch (VIEW.post.debug) {
    case DEBUG_ALBEDO: return is_lit ? encode_display(clamp(g.albedo, 0.0, 1.0)) : vec3(0.0);
    case DEBUG_NORMALS: return is_lit ? g.normal * 0.5 + 0.5 : vec3(0.0);
    case DEBUG_DEPTH: return is_lit ? vec3(1.0 - (log2(max(g.view_distance, 8.0)) - 3.0) / 10.0) : vec3(0.0);
    case DEBUG_MOTION: {
        Motion m = motion_read(pixel);
        if (m.last_view_distance < 0.0) return vec3(0.5, 0.0, 0.5);
        float size = length(m.offset);
        // motion to the right is red; full strength from 64 pixels a frame
        return size > 0.01 ? hue(atan(-m.offset.y, m.offset.x)) * clamp(log2(1.0 + size) / 6.0, 0.05, 1.0) : vec3(0.0);
    }
    case DEBUG_CLUSTERS: return is_lit ? cluster_color(cell_at(g.position + g.face_normal), g.normal) : NOTHING;
    case DEBUG_LIGHTS: return is_lit ? heat_count(float(set_count(whole_set(lights_at(g.position, g.face_normal, g.normal)))), 10.0) : NOTHING;
    case DEBUG_SAMPLES: {
        if (!is_lit) return NOTHING;
        float frames = 1.0;
        if ((VIEW.flags & VIEW_ACCUMULATE) != 0) frames = float(VIEW.accumulated + 1);
        else if ((VIEW.flags & VIEW_DENOISE) != 0 && (DENOISE.flags & DENOISE_SPARSE) == 0) frames = max(past_frames(imageLoad(uimages_r32ui[DENOISE.past], pixel).x).x, 1.0);
        return heat_count(frames * float(VIEW.lights.selection == SELECT_ALL ? 1 : VIEW.lights.samples) - 1.0, 12.0);
    }
    case DEBUG_VARIANCE: {
        if (!is_lit || (VIEW.flags & VIEW_DENOISE) == 0 || (DENOISE.flags & DENOISE_SPARSE) != 0) return NOTHING;
        vec2 variance = past_variance(imageLoad(uimages_r32ui[DENOISE.past], pixel).x);
        float deviation = sqrt(variance.x + variance.y) / max(luminance(light_of(pixel)), 1.0e-4);
        return heat((log2(max(deviation, 1.0e-4)) + 6.0) / 8.0);
    }
    case DEBUG_GRADIENTS: {
        if (!is_lit || (DENOISE.flags & DENOISE_GRADIENTS) == 0) return NOTHING;
        vec2 change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
        return heat(max(change.x, change.y));
    }
    case DEBUG_RAYS:
        if (VIEW.post.image_rays == NO_IMAGE) return NOTHING;
        return heat_count(float(imageLoad(uimages_r32ui[VIEW.post.image_rays], pixel).x), 8.0);
    case DEBUG_TIME:
    case DEBUG_RAY_TIME: return heat_time(pixel);
    case DEBUG_SPECULAR: return specular_color(pixel, g);
    }
    return NOTHING;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, picture_size()))) return;
    ivec2 target = pixel + ivec2(VIEW.target.x, VIEW.target.y);
    if (target.x < 0 || target.y < 0 || target.x >= int(VIEW.target.width) || target.y >= int(VIEW.target.height)) return;
    // shows a traced pixel as a block if fewer pixels are traced than displayed
    ivec2 traced = min(ivec2((vec2(pixel) + 0.5) * vec2(VIEW.width, VIEW.height) / vec2(picture_size())), ivec2(VIEW.width, VIEW.height) - 1);
    target_store(target, debug_color(traced));
}
