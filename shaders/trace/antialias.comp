#version 460
// Temporal antialiasing and upscaling: joins the jittered samples of many frames into a picture of the window's size.
// Method: Karis, High-Quality Temporal Supersampling (SIGGRAPH 2014 course). Variance clipping: Salvi, An Excursion in
// Temporal Supersampling (GDC 2016). Weights of the samples of a coarser grid by distance from the pixel: Yang, Liu,
// Salvi, A Survey of Temporal Antialiasing Techniques (Eurographics 2020), sections 4 and 5. Interpolation of the
// newest frame in motion: Dodgson, Quadratic Interpolation for Image Resampling (1997). Smoothed maximum of the range:
// Willberger, Musterle, Bergmann, Deferred Hybrid Path Tracing, Ray Tracing Gems (2019), section 26.5.1.
//
// Glow in front of a surface that moves differently from the surface has no history. Its share of the colour is taken
// from the newest frame alone (like the reactive mask of AMD's FidelityFX Super Resolution 2).
//
// Colours are blended in a compressed range, so that a bright sample does not outweigh all others at an edge, and
// clipped in YCoCg.
#include "trace/resolve.glsl"

// 1: the greatest luminance of the colour range is smoothed over time. 0 removes the code.
layout(constant_id = 15) const uint SMOOTH_MAXIMUM = 0;
// 1: pixels without history have more samples. 0 removes the code.
layout(constant_id = 16) const uint MORE_SAMPLES = 0;

const int GROUP = 16;
// Traced pixels that a work group may read along one axis: one for each of its pixels, and one more on each side.
const int TILE = GROUP + 2;

layout(local_size_x = GROUP, local_size_y = GROUP) in;

// Compressed colour (YCoCg) and view distance of each traced pixel.
shared vec4 tile[TILE][TILE];
// Fraction of each colour that comes from layers which moved relative to the surface, and so has no history. Negative
// where the pixel is part of the checkerboard of reflection and refraction and its own surface contributes less than
// half.
shared float fresh_parts[TILE][TILE];

// Standard deviation of the filter of a pixel with history, output pixels: about that of the pixel's square.
const float NARROW = 0.3;
// Standard deviation of the filter of a pixel without history, traced pixels.
const float WIDE = 0.5;
// Most history that a pixel keeps, in frames: at rest; in motion; in motion with fewer traced than output pixels.
// Motion resamples the history, which blurs it. In motion the newest frame counts as one frame if every output pixel is
// traced, otherwise by the distance of its samples from the pixel.
const float REST_FRAMES = 16.0, MOVING_FRAMES = 2.0, COARSE_MOVING_FRAMES = 5.0;
// The same in motion for surfaces seen through ripples: their motion is unknown, and more history would smear.
const float BENT_FRAMES = 0.5;
// Clipping range of the history, standard deviations, at rest and in motion.
const float REST_RANGE = 1.25, MOVING_RANGE = 1.0;
// Least relative change of the light within a frame that corrects the history.
const float LEAST_CHANGE = 1.0e-3;
// Spacing of the pixels from which the change of the light around a pixel is taken, pixels.
const int CHANGE_SPACING = 2;
// Largest factor by which a change of the light scales the history, up or down.
const float MOST_RATIO = 8.0;

vec4 last_resolved(vec2 uv) {
    return textureLod(sampler2D(textures[VIEW.antialias.last_resolved], samplers[VIEW.antialias.sampler_index]), uv, 0.0);
}

// Catmull-Rom filter from bilinear taps (Sigg and Hadwiger, GPU Gems 2, chapter 20), without the four corners, whose
// weights are small (Jimenez, Filmic SMAA, SIGGRAPH 2016). `place`: pixels. Alpha is that of the middle tap.
vec4 last_bicubic(vec2 place, vec2 size) {
    vec2 middle = floor(place - 0.5) + 0.5;
    vec2 f = place - middle;
    vec2 w0 = f * (-0.5 + f * (1.0 - 0.5 * f));
    vec2 w1 = 1.0 + f * f * (-2.5 + 1.5 * f);
    vec2 w2 = f * (0.5 + f * (2.0 - 1.5 * f));
    vec2 w3 = f * f * (-0.5 + 0.5 * f);
    vec2 w12 = w1 + w2;
    vec2 low = (middle - 1.0) / size, high = (middle + 2.0) / size, inner = (middle + w2 / w12) / size;
    vec4 center = last_resolved(inner);
    vec3 sum = center.rgb * (w12.x * w12.y);
    sum += last_resolved(vec2(inner.x, low.y)).rgb * (w12.x * w0.y);
    sum += last_resolved(vec2(low.x, inner.y)).rgb * (w0.x * w12.y);
    sum += last_resolved(vec2(high.x, inner.y)).rgb * (w3.x * w12.y);
    sum += last_resolved(vec2(inner.x, high.y)).rgb * (w12.x * w3.y);
    float weight = w12.x * w12.y + w12.x * (w0.y + w3.y) + w12.y * (w0.x + w3.x);
    return vec4(max(sum / weight, 0.0), center.a);
}

// Kernel of quadratic interpolation: interpolates 3 x 3 samples one pixel apart, as sharp as a cubic.
float quadratic(float x) {
    x = abs(x);
    return x < 0.5 ? 1.0 - 2.0 * x * x : x < 1.5 ? (x - 2.5) * x + 1.5 : 0.0;
}

// Scales the history of a resting pixel by the change of the light since the last frame. Repeated each frame, this
// brings all samples of the history to the current light. The mean over a neighbourhood of the surface gives the
// change, because the light of one pixel also changes by noise, which the mean over frames has to remove.
vec3 history_in_current_light(vec3 color, ivec2 pixel, float view_distance) {
    const uint KNOWN = DENOISE_HISTORY | DENOISE_GRADIENTS;
    if ((VIEW.flags & VIEW_DENOISE) == 0 || (DENOISE.flags & KNOWN) != KNOWN) return color;
    // exactly 0 where nothing has changed
    vec2 change = imageLoad(images_rg16f[DENOISE.gradient], pixel / STRATUM).xy;
    if (max(change.x, change.y) < LEAST_CHANGE) return color;
    vec3 now = vec3(1.0e-6), then = vec3(1.0e-6);
    float slack = SAME_DISTANCE * view_distance + 1.0;
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            ivec2 at = clamp(pixel + CHANGE_SPACING * ivec2(x, y), ivec2(0), ivec2(VIEW.width, VIEW.height) - 1);
            // only pixels that rest on the same surface in both frames
            vec2 distances = vec2(imageLoad(images_r16f[VIEW.motion.view_distance], at).x, last_view_distance_read(at));
            if (any(greaterThan(abs(distances - view_distance), vec2(slack)))) continue;
            now += light_of(at);
            then += light_read(VIEW.antialias.last_light, at);
        }
    }
    if (!is_lit_read(pixel)) return color;
    GBufferPixel g;
    shown_read(VIEW.images.shown, pixel, g);
    vec3 ratio = clamp(now / then, 1.0 / MOST_RATIO, MOST_RATIO);
    // half of the light of a checkerboard pixel is from the other field
    if (mark_field(mark_read(pixel)) > 0.0) ratio = mix(vec3(1.0), ratio, 0.5);
    vec3 front = min(g.front * exp2(-VIEW.exposure.base), color);
    return (color - front) * ratio + front;
}

// Brings the luminance of a colour (YCoCg) down to a bound; the hue stays.
vec3 darkened(vec3 color, float most) { return color.x > most ? color * (most / color.x) : color; }

void main() {
    ivec2 output_size = ivec2(VIEW.antialias.output_width, VIEW.antialias.output_height);
    ivec2 traced_size = ivec2(VIEW.width, VIEW.height);
    vec2 ratio = vec2(traced_size) / vec2(output_size);
    float exposure = compression();

    ivec2 first = ivec2(floor((vec2(gl_WorkGroupID.xy) * float(GROUP) + 0.5) * ratio)) - 1;
    for (int i = int(gl_LocalInvocationIndex); i < TILE * TILE; i += GROUP * GROUP) {
        ivec2 at = ivec2(i % TILE, i / TILE);
        ivec2 pixel = clamp(first + at, ivec2(0), traced_size - 1);
        vec4 color = imageLoad(images_rgba16f[VIEW.images.composite], pixel);
        tile[at.y][at.x] = vec4(to_ycocg(compress(color.rgb, exposure)), view_distance_read(pixel));
        fresh_parts[at.y][at.x] = color.a == 0.0 ? LEAST_FRESH : color.a;
    }
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, output_size))) return;

    // traced samples around the pixel
    vec2 place = (vec2(pixel) + 0.5) * ratio;
    ivec2 middle = ivec2(floor(place));
    vec3 sum = vec3(0.0), squares = vec3(0.0);
    vec4 narrow = vec4(0.0), wide = vec4(0.0);
    vec3 between = vec3(0.0), least = vec3(1.0e30), most = vec3(-1.0e30);
    // an edge moves with the nearest surface; within one surface the pixel's own motion is exact. A surface that
    // contributes less than half does not set the motion
    bool lesser = fresh_parts[middle.y - first.y][middle.x - first.x] < 0.0;
    float nearest = lesser ? 1.0e30 : tile[middle.y - first.y][middle.x - first.x].w * IN_FRONT;
    ivec2 nearest_at = ivec2(0);
    float fresh = 0.0;
    for (int y = -1; y <= 1; y++) {
        for (int x = -1; x <= 1; x++) {
            ivec2 at = middle + ivec2(x, y) - first;
            vec4 s = tile[at.y][at.x];
            vec2 away = vec2(middle + ivec2(x, y)) + 0.5 + VIEW.antialias.jitter - place;
            vec2 away_output = away / ratio;
            narrow += vec4(s.rgb, 1.0) * exp(dot(away_output, away_output) * (-0.5 / (NARROW * NARROW)));
            wide += vec4(s.rgb, 1.0) * exp(dot(away, away) * (-0.5 / (WIDE * WIDE)));
            between += s.rgb * (quadratic(away.x) * quadratic(away.y));
            least = min(least, s.rgb);
            most = max(most, s.rgb);
            sum += s.rgb;
            squares += s.rgb * s.rgb;
            // neighbours count too: samples of an edge pixel hit the layer in one frame and miss it in the next
            float fresh_part = fresh_parts[at.y][at.x];
            fresh = max(fresh, abs(fresh_part) - LEAST_FRESH);
            if (s.w < nearest && fresh_part >= 0.0) {
                nearest = s.w;
                nearest_at = ivec2(x, y);
            }
        }
    }
    vec3 mean = sum / 9.0;
    vec3 deviation = sqrt(max(squares / 9.0 - mean * mean, 0.0));

    // the same point in the last frame
    Motion motion = motion_read(clamp(middle + nearest_at, ivec2(0), traced_size - 1));
    vec2 last_place = vec2(pixel) + 0.5 + motion.offset / ratio;
    vec3 old = mean;
    float frames = 0.0, maximum = 0.0;
    bool known = VIEW.antialias.history != 0 && motion.last_view_distance >= 0.0
        && all(greaterThanEqual(last_place, vec2(0.0))) && all(lessThan(last_place, vec2(output_size)));
    bool rests = motion.offset == vec2(0.0), is_fine = traced_size == output_size;
    float range = rests ? REST_RANGE : MOVING_RANGE;
    // of a line that is brighter than the range the pixel's own sample
    if (SMOOTH_MAXIMUM != 0) maximum = max(mean.x + deviation.x * range, tile[middle.y - first.y][middle.x - first.x].x);
    if (known && was_seen(last_place * ratio, motion.last_view_distance, rests, mark_field(motion.mark) > 0.0)) {
        vec4 history = last_bicubic(last_place, vec2(output_size));
        if (rests) history.rgb = history_in_current_light(history.rgb, middle, view_distance_read(middle));
        old = to_ycocg(compress(history.rgb, exposure));
        vec3 off = old - mean;
        vec3 parts = abs(off) / (deviation * range + 1.0e-4);
        if (SMOOTH_MAXIMUM != 0) {
            float last = imageLoad(images_r16f[VIEW.antialias.last_maximum], ivec2(last_place)).x;
            maximum = mix(maximum, last, VIEW.antialias.maximum_kept);
            if (off.x > 0.0) parts.x = off.x / max(maximum - mean.x, 1.0e-4);
        }
        old = mean + off / max(max_component(parts), 1.0);
        // the history contributes only the fraction that is not new
        float kept = rests ? REST_FRAMES : mark_bent(motion.mark) ? BENT_FRAMES : is_fine ? MOVING_FRAMES : COARSE_MOVING_FRAMES;
        frames = min(min(history.a, kept), (1.0 - fresh) / max(fresh, 1.0e-3));
    }
    vec3 now = wide.rgb / wide.w;
    float confidence = 1.0;
    if (frames > 0.0 && !rests && is_fine) {
        now = clamp(between, least, most);
    } else if (frames > 0.0) {
        confidence = mix(min(narrow.w, 1.0), 1.0, fresh);
        if (narrow.w > 1.0e-3) now = mix(narrow.rgb / narrow.w, now, fresh);
    }
    if (MORE_SAMPLES != 0 && frames == 0.0) {
        vec4 more = imageLoad(images_rgba16f[VIEW.antialias.more_samples], middle);
        if (more.a > 0.0) {
            now = more.rgb;
            confidence = more.a;
        }
    }
    if (SMOOTH_MAXIMUM != 0) {
        // an edge in motion may be at another texel than the last maximum; ripples under a camera at rest have no offset
        if (frames > 0.0 && all(lessThanEqual(abs(motion.offset), vec2(LEAST_OFFSET)))) now = darkened(now, maximum);
        imageStore(images_r16f[VIEW.antialias.maximum], pixel, vec4(maximum));
    }
    float total = frames + confidence;
    vec3 color = mix(old, now, confidence / total);
    vec3 shown = expand(max(from_ycocg(color), 0.0), exposure);
    imageStore(images_rgba16f[VIEW.antialias.image_resolved], pixel, vec4(min(shown, vec3(60000.0)), total));
}
