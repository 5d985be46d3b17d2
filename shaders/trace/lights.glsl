// Direct light on a point: which lights can matter, the estimators that choose among them, and points on lights.
//
// Light is measured as L, the radiance that a white diffuse surface would show: irradiance divided by pi. Every
// estimator divides by the probability with which it made its choices, so all of them have the same mean.
#ifndef RELIGHT_TRACE_LIGHTS_GLSL
#define RELIGHT_TRACE_LIGHTS_GLSL

#include "trace/color.glsl"
#include "trace/random.glsl"
#include "trace/trace.glsl"

const uint MASK_SHADOW = MASK_SOLID | MASK_THIRD_SOLID;

// The lights that may reach a point: a cluster's list, then the suns, then the game's dynamic lights.
struct LightSet {
    uint first;
    uint listed;
    uint count;
};

// Cluster of a point by a walk through the map's tree; the row of "all lights" for a point in no cluster.
uint cluster_at(vec3 position) {
    uint all = VIEW.cluster_count;
    if (VIEW.node_count == 0) return all;
    BspNodes nodes = BspNodes(VIEW.nodes);
    int index = 0;
    // a tree is never deeper than it has nodes; this also ends on a cyclic one
    for (uint i = 0; i <= VIEW.node_count && index >= 0; i++) {
        BspNode node = nodes.at[index];
        index = node.children[dot(node.plane.xyz, position) >= node.plane.w ? 0 : 1];
    }
    if (index >= 0) return all;
    int cluster = Integers(VIEW.leaf_clusters).at[-1 - index];
    return cluster >= 0 && uint(cluster) < all ? uint(cluster) : all;
}

LightSet lights_at(vec3 position, vec3 normal) {
    // a point of a surface lies on the boundary of leaves: step into the room that it faces
    uint cluster = cluster_at(position + normal);
    Indices offsets = Indices(VIEW.light_offsets);
    LightSet set;
    set.first = offsets.at[cluster];
    set.listed = offsets.at[cluster + 1] - set.first;
    set.count = set.listed + VIEW.sun_count + VIEW.dynamic_light_count;
    return set;
}

const uint LIGHT_KIND_TRIANGLE = 0, LIGHT_KIND_SPHERE = 1, LIGHT_KIND_SUN = 2, LIGHT_KIND_DYNAMIC = 3;

// Kind and index of a set's member.
uvec2 light_reference(LightSet set, uint member) {
    if (member < set.listed) {
        uint index = Indices(VIEW.light_indices).at[set.first + member];
        return index < VIEW.triangle_light_count ? uvec2(LIGHT_KIND_TRIANGLE, index)
                                                 : uvec2(LIGHT_KIND_SPHERE, index - VIEW.triangle_light_count);
    }
    member -= set.listed;
    return member < VIEW.sun_count ? uvec2(LIGHT_KIND_SUN, member) : uvec2(LIGHT_KIND_DYNAMIC, member - VIEW.sun_count);
}

SphereLight sphere_light(uvec2 reference) {
    if (reference.x == LIGHT_KIND_SPHERE) return SphereLights(VIEW.sphere_lights).at[reference.y];
    return SphereLights(VIEW.dynamic_lights).at[reference.y];
}

// Solid angle of a triangle of unit vectors (Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983).
float solid_angle(vec3 a, vec3 b, vec3 c) {
    float numerator = abs(dot(a, cross(b, c)));
    float denominator = 1.0 + dot(a, b) + dot(b, c) + dot(c, a);
    return 2.0 * atan(numerator, denominator);
}

float angle_between(vec3 a, vec3 b) {
    // exact near 0 and pi too, unlike the arc cosine
    if (dot(a, b) < 0.0) return PI - 2.0 * asin(min(length(a + b) * 0.5, 1.0));
    return 2.0 * asin(min(length(b - a) * 0.5, 1.0));
}

// A direction to a spherical triangle, uniform in solid angle (Arvo, Stratified Sampling of Spherical Triangles, 1995).
// a, b, c: unit vectors. The triangle must not be degenerate.
vec3 sample_spherical_triangle(vec3 a, vec3 b, vec3 c, vec2 u) {
    vec3 n_ab = normalize(cross(a, b)), n_bc = normalize(cross(b, c)), n_ca = normalize(cross(c, a));
    float alpha = angle_between(n_ab, -n_ca), beta = angle_between(n_bc, -n_ab), gamma = angle_between(n_ca, -n_bc);
    // the angle sum of the part-triangle that holds the fraction u.x of the area
    float part = mix(PI, alpha + beta + gamma, u.x);
    float cos_alpha = cos(alpha), sin_alpha = sin(alpha);
    float sin_phi = sin(part) * cos_alpha - cos(part) * sin_alpha;
    float cos_phi = cos(part) * cos_alpha + sin(part) * sin_alpha;
    float k1 = cos_phi + cos_alpha;
    float k2 = sin_phi - sin_alpha * dot(a, b);
    float denominator = (k2 * sin_phi + k1 * cos_phi) * sin_alpha;
    float cos_side = denominator != 0.0 ? (k2 + (k2 * cos_phi - k1 * sin_phi) * cos_alpha) / denominator : 1.0;
    cos_side = clamp(cos_side, -1.0, 1.0);
    vec3 along = normalize(c - a * dot(c, a));
    vec3 c_part = cos_side * a + sqrt(max(1.0 - cos_side * cos_side, 0.0)) * along;
    float z = 1.0 - u.y * (1.0 - dot(c_part, b));
    vec3 across = c_part - b * dot(c_part, b);
    float len = length(across);
    across = len > 1.0e-9 ? across / len : vec3(0.0);
    return z * b + sqrt(max(1.0 - z * z, 0.0)) * across;
}

// Below this solid angle a triangle is sampled by area: the spherical formulas lose their digits there.
const float MIN_SOLID_ANGLE = 2.0e-3;

// Two unit vectors at right angles to n (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
void basis(vec3 n, out vec3 t, out vec3 b) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float c = n.x * n.y * a;
    t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
    b = vec3(c, s + n.y * n.y * a, -n.y);
}

// A direction in the cone around `axis` whose half angle has the given cosine, uniform in solid angle.
vec3 sample_cone(vec3 axis, float cos_angle, vec2 u) {
    vec3 t, b;
    basis(axis, t, b);
    float z = 1.0 - u.x * (1.0 - cos_angle);
    float r = sqrt(max(1.0 - z * z, 0.0));
    float phi = 2.0 * PI * u.y;
    return t * (r * cos(phi)) + b * (r * sin(phi)) + axis * z;
}

// Part of a sphere light's radiance that goes towards a point in `direction` from it.
float spot_factor(SphereLight light, vec3 direction) {
    if (light.cos_outer <= -2.0) return 1.0;
    float c = dot(light.axis, direction);
    return clamp((c - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1.0e-4), 0.0, 1.0);
}

// A point on a light as seen from a surface: `light` is the unshadowed L that the sample stands for, pdf divided out.
struct LightSample {
    vec3 direction;
    float distance; // to the end of the shadow ray
    vec3 light;
    bool sky; // comes through the sky: any piece of it in the way lets it in
};

LightSample no_light() { return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), false); }

LightSample sample_triangle(TriangleLight light, vec3 position, vec3 normal, vec2 u) {
    LightSample s = no_light();
    vec3 a = light.corners[0] - position, b = light.corners[1] - position, c = light.corners[2] - position;
    vec3 face = cross(b - a, c - a);
    float double_area = length(face);
    if (double_area <= 0.0) return s;
    face /= double_area;
    float height = dot(a, face); // negative where the emitting side is seen
    if (height >= 0.0 && (light.flags & LIGHT_TWO_SIDED) == 0) return s;
    vec3 ua = safe_normalize(a, vec3(0)), ub = safe_normalize(b, vec3(0)), uc = safe_normalize(c, vec3(0));
    float omega = solid_angle(ua, ub, uc);
    if (omega > MIN_SOLID_ANGLE) {
        s.direction = sample_spherical_triangle(ua, ub, uc, u);
        float rate = dot(s.direction, face);
        if (abs(rate) < 1.0e-7) return no_light();
        s.distance = height / rate;
        if (!(s.distance > 0.0)) return no_light();
        s.light = light.radiance * (omega / PI);
    } else {
        float r = sqrt(u.x);
        vec3 to = a * (1.0 - r) + b * (r * (1.0 - u.y)) + c * (r * u.y);
        float squared = dot(to, to);
        if (squared < 1.0e-12) return s;
        s.distance = sqrt(squared);
        s.direction = to / s.distance;
        s.light = light.radiance * (0.5 * double_area * abs(dot(s.direction, face)) / (squared * PI));
    }
    s.light *= max(dot(normal, s.direction), 0.0);
    // stop short of the light's own surface
    s.distance -= 0.02 + 1.0e-3 * s.distance;
    s.sky = (light.flags & LIGHT_SKY) != 0;
    return s;
}

LightSample sample_sphere(SphereLight light, vec3 position, vec3 normal, vec2 u) {
    LightSample s = no_light();
    vec3 to = light.origin - position;
    float squared = dot(to, to);
    float d = sqrt(squared);
    // from inside the sphere it is a light of the same intensity one radius away
    float sine = min(light.radius / max(d, light.radius), 0.9999);
    float cos_angle = sqrt(1.0 - sine * sine);
    vec3 axis = d > 1.0e-6 ? to / d : normal;
    s.direction = sample_cone(axis, cos_angle, u);
    float omega = 2.0 * PI * (sine * sine) / (1.0 + cos_angle); // 2 pi (1 - cos) without its cancellation
    s.light = light.radiance * (omega / PI * max(dot(normal, s.direction), 0.0) * spot_factor(light, -axis));
    s.distance = d - max(light.clearance, light.radius);
    return s;
}

LightSample sample_sun(SunLight light, vec3 normal, vec2 u) {
    LightSample s;
    s.direction = sample_cone(light.direction, light.cos_angle, u);
    s.distance = FAR;
    s.light = light.irradiance * max(dot(normal, s.direction), 0.0);
    s.sky = true;
    return s;
}

LightSample sample_light(uvec2 reference, vec3 position, vec3 normal, vec2 u) {
    LightSample s;
    if (reference.x == LIGHT_KIND_TRIANGLE) s = sample_triangle(TriangleLights(VIEW.triangle_lights).at[reference.y], position, normal, u);
    else if (reference.x == LIGHT_KIND_SUN) s = sample_sun(SunLights(VIEW.suns).at[reference.y], normal, u);
    else s = sample_sphere(sphere_light(reference), position, normal, u);
    if (reference.x != LIGHT_KIND_DYNAMIC) s.light *= VIEW.light_scale;
    return s;
}

// Target function of resampling, for all but suns: about the luminance that the light would give without shadows. Zero only where the
// light gives exactly nothing, so that choosing by it leaves no light out.
float light_target(uvec2 reference, vec3 position, vec3 normal) {
    if (reference.x == LIGHT_KIND_TRIANGLE) {
        TriangleLight light = TriangleLights(VIEW.triangle_lights).at[reference.y];
        vec3 a = light.corners[0] - position, b = light.corners[1] - position, c = light.corners[2] - position;
        vec3 face = cross(b - a, c - a);
        if (dot(a, face) >= 0.0 && (light.flags & LIGHT_TWO_SIDED) == 0) return 0.0;
        vec3 ua = safe_normalize(a, vec3(0)), ub = safe_normalize(b, vec3(0)), uc = safe_normalize(c, vec3(0));
        // the cosine at a corner is the greatest over the triangle or near it; nothing above the horizon: no light
        float cosine = max(dot(normal, ua), 0.0) + max(dot(normal, ub), 0.0) + max(dot(normal, uc), 0.0);
        if (cosine <= 0.0) return 0.0;
        float omega = solid_angle(ua, ub, uc);
        // the flat formula where the spherical one is below its precision
        if (omega < 1.0e-6) omega = 0.5 * abs(dot(face, ua)) / max(dot(a, a), 1.0e-12);
        return luminance(light.radiance) * VIEW.light_scale * max(omega, 1.0e-12) * (cosine / 3.0) / PI;
    }
    SphereLight light = sphere_light(reference);
    vec3 to = light.origin - position;
    float squared = max(dot(to, to), light.radius * light.radius);
    vec3 axis = safe_normalize(to, normal);
    float sine = light.radius * inversesqrt(squared);
    float cosine = dot(normal, axis);
    if (cosine <= -sine) return 0.0;
    float scale = reference.x == LIGHT_KIND_DYNAMIC ? 1.0 : VIEW.light_scale;
    return luminance(light.radiance) * scale * sine * sine * max(cosine, 0.5 * sine) * spot_factor(light, -axis);
}

// Whether the sample's light arrives. Sun and sky arrive where the ray meets sky first or leaves the map.
bool light_arrives(LightSample s, vec3 origin) {
    if (!s.sky && s.distance <= 0.0) return true;
    Hit hit = trace_ray(origin, 0.0, s.direction, s.distance, s.sky ? MASK_SHADOW | MASK_SKY : MASK_SHADOW, !s.sky);
    return hit.geometry == NO_HIT || (s.sky && Geometries(VIEW.geometries).at[hit.geometry].kind == KIND_SKY);
}

// The member of a set's list that a number in [0, 1) falls on, and the chance of that.
uint pick_listed(LightSet set, float u, out float chance) {
    Chances chances = Chances(VIEW.light_chances);
    uint low = 0, high = set.listed - 1;
    while (low < high) {
        uint middle = (low + high) / 2;
        if (chances.at[set.first + middle] > u) high = middle;
        else low = middle + 1;
    }
    chance = chances.at[set.first + low] - (low > 0 ? chances.at[set.first + low - 1] : 0.0);
    return low;
}

// A light to send a ray to, and what its light is to be multiplied by; weight 0: none.
struct LightChoice {
    uvec2 reference;
    float weight;
};

// One light, each with the same probability.
LightChoice choose_uniform(LightSet set) {
    uint member = min(uint(rng_next() * float(set.count)), set.count - 1);
    return LightChoice(light_reference(set, member), float(set.count));
}

// One of the suns; a map has one as a rule.
LightChoice choose_sun() {
    uint count = VIEW.sun_count;
    uint index = count > 1 ? min(uint(rng_next() * float(count)), count - 1) : 0;
    return LightChoice(uvec2(LIGHT_KIND_SUN, index), float(count));
}

// Resampled importance sampling (Talbot et al. 2005): some candidates, one of them chosen by its target, weighed by
// the inverse of the chance that it had. Candidates come from the cluster's list, by what each light can give to the
// cluster; dynamic lights are always among them, and so is the whole list if it is short enough. The target does not
// know about shadows, and a hidden sun would outshine all that is left in its shadow: suns get a ray of their own.
LightChoice choose_resampled(LightSet set, vec3 position, vec3 normal) {
    uint drawn = max(VIEW.candidates, 1);
    bool whole = set.listed <= drawn;
    if (whole) drawn = set.listed;
    uint candidates = drawn + VIEW.dynamic_light_count;
    float sum = 0.0, chosen_target = 0.0;
    uvec2 chosen = uvec2(0);
    for (uint i = 0; i < candidates; i++) {
        uint member = i < drawn ? i : set.listed + VIEW.sun_count + i - drawn;
        float weight = 1.0;
        if (i < drawn && !whole) {
            float chance;
            // stratified
            member = pick_listed(set, (float(i) + rng_next()) / float(drawn), chance);
            if (!(chance > 0.0)) continue;
            weight = 1.0 / (chance * float(drawn));
        }
        uvec2 reference = light_reference(set, member);
        float target = light_target(reference, position, normal);
        if (!(target > 0.0)) continue;
        sum += target * weight;
        if (rng_next() * sum < target * weight) {
            chosen = reference;
            chosen_target = target;
        }
    }
    return LightChoice(chosen, chosen_target > 0.0 ? sum / chosen_target : 0.0);
}

// Direct light on a point whose surface faces `face_normal`, with `samples` independent estimates.
vec3 direct_light(vec3 position, vec3 face_normal, vec3 normal, uint sampling, uint samples) {
    LightSet set = lights_at(position, face_normal);
    if (set.count == 0) return vec3(0.0);
    vec3 origin = offset_ray(position, face_normal);
    vec3 sum = vec3(0.0);
    samples = max(samples, 1);
    // rays of one estimate
    uint rays = 1;
    if (sampling == SAMPLING_ALL) rays = set.count;
    else if (sampling == SAMPLING_RESAMPLED && VIEW.sun_count > 0) rays = 2;
    for (uint i = 0; i < samples * rays; i++) {
        uint ray = i % rays;
        LightChoice choice;
        if (sampling == SAMPLING_UNIFORM) choice = choose_uniform(set);
        else if (sampling == SAMPLING_ALL) choice = LightChoice(light_reference(set, ray), 1.0);
        else if (ray == 1) choice = choose_sun();
        else choice = choose_resampled(set, position, normal);
        if (!(choice.weight > 0.0)) continue;
        LightSample s = sample_light(choice.reference, position, normal, rng_next2());
        if (max_component(s.light) > 0.0 && light_arrives(s, origin)) sum += s.light * choice.weight;
    }
    return sum / float(samples);
}

#endif
