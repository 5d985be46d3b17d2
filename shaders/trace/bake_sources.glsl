// Lights as a point of a bake sees them, without shadows.
#ifndef RELIGHT_TRACE_BAKE_SOURCES_GLSL
#define RELIGHT_TRACE_BAKE_SOURCES_GLSL

#include "trace/bake.glsl"

// Area over squared distance, an approximate solid angle, sr, from which a triangle gets more rays: in proportion to it, up
// to MOST_WIDER times as many; and with 0 samples WIDE_RAYS.
const float WIDE = 0.15;
const float MOST_WIDER = 4.0;
const uint WIDE_RAYS = 8;

// A triangle whose radius is below this part of its distance lights as a point at its centroid; the error is 0.1 %.
const float POINT_LIKE = 0.03;

// Part of the radius of a spot's cone, units, over which the map compiler fades it out.
const float SPOT_FADE = 32.0;

// Least distance at which the light of a point is computed, units: q3map2 avoids spots by it.
const float NEAREST = 16.0;

// Kinds of light sources.
const uint SEEN_TRIANGLE = 0, SEEN_POINT = 1, SEEN_SUN = 2, SEEN_SKY = 3;

// A light as a point sees it. The vectors are relative to the point.
struct Source {
    uint kind; // SEEN_*
    vec3 light; // unshadowed L; of a direction to the sky for radiance 1
    uint rays;
    bool middle; // rays go to the light's middle, or to the same points of it from everywhere
    bool two_sided;
    vec3 a; // corners of a triangle; the centre of a sphere; the direction to a sun or the sky
    vec3 b;
    vec3 c;
    vec3 target; // middle of the part of a triangle above the horizon
    float omega; // solid angle of a triangle
    float size; // radius of a sphere; cosine of the radius of a sun
};

// Its light in the brightest channel; negative lights take light away.
float size_of(Source s) { return max_component(abs(s.light)); }

// Irradiance by a triangle of radiance 1, over pi; `middle`: the middle of its part above the horizon. Half the sum over the
// edges of angle times cosine (Lambert); the corners are relative to the point.
float polygon_light(vec3 a, vec3 b, vec3 c, vec3 normal, out vec3 middle) {
    vec3 from[3] = vec3[](a, b, c);
    vec3 kept[4];
    uint count = 0;
    middle = vec3(0.0);
    for (uint i = 0; i < 3; i++) {
        vec3 p = from[i], q = from[i == 2 ? 0 : i + 1];
        float above = dot(p, normal), next = dot(q, normal);
        if (above > 0.0 && count < 4) kept[count++] = p;
        if ((above > 0.0) != (next > 0.0) && count < 4) kept[count++] = p + (q - p) * (above / (above - next));
    }
    if (count < 3) return 0.0;
    float sum = 0.0;
    for (uint i = 0; i < count; i++) {
        vec3 p = kept[i], q = kept[i + 1 == count ? 0 : i + 1];
        middle += p;
        vec3 across = cross(p, q);
        float size = length(across);
        if (size > 1.0e-12) sum += atan(size, dot(p, q)) * dot(across, normal) / size;
    }
    middle /= float(count);
    return min(abs(sum) / (2.0 * PI), 1.0);
}

uint rays_of(float wide) {
    if (push.samples == 0) return wide > WIDE ? WIDE_RAYS : 1;
    return uint(ceil(float(push.samples) * clamp(wide / WIDE, 1.0, MOST_WIDER)));
}

void see_triangle(TriangleLight light, BakePoint point, inout Source s) {
    s.kind = SEEN_TRIANGLE;
    s.two_sided = (light.flags & LIGHT_TWO_SIDED) != 0;
    s.a = light.corners[0] - point.position;
    s.b = light.corners[1] - point.position;
    s.c = light.corners[2] - point.position;
    vec3 area = 0.5 * cross(s.b - s.a, s.c - s.a);
    if (dot(area, s.a) >= 0.0 && !s.two_sided) return;
    s.target = (s.a + s.b + s.c) / 3.0;
    float squared = dot(s.target, s.target);
    if (!(squared > 0.0)) return;
    vec3 to_a = s.a - s.target, to_b = s.b - s.target, to_c = s.c - s.target;
    float extent = max(dot(to_a, to_a), max(dot(to_b, to_b), dot(to_c, to_c)));
    bool free = has_no_surface(point);
    float least = min(dot(s.a, point.normal), min(dot(s.b, point.normal), dot(s.c, point.normal)));
    float part;
    if (extent < POINT_LIKE * POINT_LIKE * squared && (free || least > 0.0)) {
        s.omega = abs(dot(area, s.target)) * inversesqrt(squared) / squared;
        part = s.omega * incidence(point, s.target * inversesqrt(squared)) / PI;
    } else {
        s.omega = solid_angle(safe_normalize(s.a, vec3(0.0)), safe_normalize(s.b, vec3(0.0)), safe_normalize(s.c, vec3(0.0)));
        part = free ? s.omega / PI : polygon_light(s.a, s.b, s.c, point.normal, s.target);
    }
    s.light = light.radiance * part;
    if (size_of(s) < light.end) s.light = vec3(0.0);
    s.rays = rays_of(length(area) / squared);
    s.middle = push.samples == 0;
}

void see_point(BakePointLight light, BakePoint point, inout Source s) {
    s.kind = SEEN_POINT;
    s.a = light.origin - point.position;
    s.size = light.radius;
    float away = length(s.a);
    if (!(away > 0.0)) return;
    float cosine = incidence(point, s.a / away), distance = max(away, NEAREST);
    float part = cosine / (distance * distance);
    if (light.reach != 0.0) {
        // negative: the light does not depend on its angle of incidence
        float facing = light.reach < 0.0 ? float(cosine > 0.0) : cosine;
        part = 8.0 / (light.reach * light.reach) * max(facing - distance / abs(light.reach), 0.0);
    }
    if (light.tan_half_angle >= 0.0) {
        float along = -dot(s.a, light.axis);
        float aside = sqrt(max(away * away - along * along, 0.0));
        part *= along > 0.0 ? clamp((along * light.tan_half_angle - aside) / SPOT_FADE, 0.0, 1.0) : 0.0;
    }
    s.light = light.intensity * part;
    if (size_of(s) < light.end) s.light = vec3(0.0);
    s.middle = push.samples == 0 || light.radius <= 0.0;
    s.rays = s.middle ? 1 : push.samples;
}

void see_sun(SunLight light, BakePoint point, inout Source s) {
    s.kind = SEEN_SUN;
    s.a = light.direction;
    s.size = light.cos_angle;
    s.light = light.irradiance * incidence(point, light.direction);
    s.middle = push.samples == 0 || light.cos_angle >= 1.0;
    s.rays = s.middle ? 1 : push.samples;
}

// Directions over the sphere, the same for all points, so that neighbours do not differ by noise: a Fibonacci spiral.
void see_sky(uint number, uint directions, BakePoint point, inout Source s) {
    const float GOLDEN = 0.6180339887;
    s.kind = SEEN_SKY;
    float z = 1.0 - (2.0 * float(number) + 1.0) / float(directions);
    float radius = sqrt(max(1.0 - z * z, 0.0)), angle = 2.0 * PI * fract(float(number) * GOLDEN);
    s.a = vec3(radius * cos(angle), radius * sin(angle), z);
    // the mean over the sphere times 4 pi, over pi
    s.light = vec3(incidence(point, s.a) * 4.0 / float(directions));
    s.rays = 1;
}

// Whether it is a light of a list; of those weak ones are left out.
bool is_listed(Source s) { return s.kind <= SEEN_POINT; }

// The lights that a point may see: suns, directions to the sky, the entries of a list.
struct List {
    uint suns;
    uint directions;
    uint first;
    uint count;
};

List list_at(vec3 position) {
    uint row = bake_row(position);
    List list = List(0, 0, Indices(BAKE.rows).at[row], 0);
    list.count = Indices(BAKE.rows).at[row + 1] - list.first;
    if (Indices(BAKE.skies).at[row] != 0) {
        list.suns = BAKE.sun_count;
        list.directions = BAKE.sky_directions;
    }
    return list;
}

// The number of a member of the list; `key`: unique for each light.
Source see(uint member, List list, BakePoint point, out uint key) {
    Source s = Source(SEEN_SUN, vec3(0.0), 0, true, false, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);
    key = ~member;
    if (member < list.suns) {
        see_sun(SunLights(BAKE.suns).at[member], point, s);
        return s;
    }
    member -= list.suns;
    if (member < list.directions) {
        see_sky(member, list.directions, point, s);
        return s;
    }
    key = Indices(BAKE.entries).at[list.first + member - list.directions];
    if (key < BAKE.triangle_count) see_triangle(TriangleLights(BAKE.triangles).at[key], point, s);
    else see_point(BakePointLights(BAKE.points).at[key - BAKE.triangle_count], point, s);
    return s;
}

#endif
