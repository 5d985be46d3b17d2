// Lights at a point: the lists of lights that may reach it, the estimators that select among them, and sampling of
// points on lights.
//
// Light is measured as L, the radiance of a white diffuse surface: irradiance divided by pi. Every estimator divides by
// its probability, so all estimators have the same mean.
#ifndef RELIGHT_TRACE_LIGHTS_GLSL
#define RELIGHT_TRACE_LIGHTS_GLSL

#include "trace/color.glsl"
#include "trace/random.glsl"
#include "trace/geometry.glsl"
#include "trace/light_tree.glsl"

// 1: listed lights are drawn from the tree.
layout(constant_id = 10) const uint LIGHT_TREE = 0;

// The lights that may reach a point: those of a row and its parent, the suns, and the list of lights of this frame.
struct LightSet {
    uint first;
    uint listed; // slots of the row
    uint parent; // NO_PARENT: the row has all listed lights
    bool swept;
    uint suns;
    uint dynamic_first;
    uint dynamic_count;
};

// Number of lights of a set without a parent; of others, not below 1 if there is any light.
uint set_count(LightSet set) { return set.listed + set.suns + set.dynamic_count; }

// Cell of a point (a piece of a cluster), by a walk through the BSP tree; the number of cells for a point in none.
uint cell_at(vec3 position) {
    uint no_cell = VIEW.lights.cell_count;
    uint node_count = VIEW.lights.node_count;
    if (node_count == 0) return no_cell;
    BspNodes nodes = BspNodes(VIEW.lights.nodes);
    int index = 0;
    uvec3 size = uvec3(VIEW.lights.grid_size[0], VIEW.lights.grid_size[1], VIEW.lights.grid_size[2]);
    // tested as floats, because converting negative numbers to unsigned is undefined
    vec3 at = (position - VIEW.lights.grid_origin) * VIEW.lights.grid_scale;
    if (all(greaterThanEqual(at, vec3(0.0))) && all(lessThan(at, vec3(size)))) {
        uvec3 box = uvec3(at);
        index = Integers(VIEW.lights.grid).at[(box.z * size.y + box.y) * size.x + box.x];
    }
    // a tree is at most as deep as its number of nodes; the bound also ends a cyclic one
    for (uint i = 0; i <= node_count && index >= 0; i++) {
        BspNode node = nodes.at[index];
        index = node.children[dot(node.plane.xyz, position) >= node.plane.w ? 0 : 1];
    }
    if (index >= 0) return no_cell;
    int cell = Integers(VIEW.lights.leaf_cells).at[-1 - index];
    return cell >= 0 && uint(cell) < no_cell ? uint(cell) : no_cell;
}

// Normal bin: the nearest of the six signed axes.
uint normal_bin_of(vec3 normal) {
    vec3 size = abs(normal);
    uint axis = size.x >= max(size.y, size.z) ? 0 : size.y >= size.z ? 1 : 2;
    return axis * 2 + (normal[axis] < 0.0 ? 1 : 0);
}

// The lights of a row of the lists.
LightSet lights_of(uint place) {
    LightRow row = LightRows(VIEW.lights.rows).at[place];
    uint suns = (row.flags & LIGHT_ROW_SUNS) != 0 ? VIEW.lights.sun_count : 0;
    LightSet set = LightSet(row.first, row.count, row.parent, (row.flags & LIGHT_ROW_SWEPT) != 0, suns, 0, 0);
    uint dynamic_rows = VIEW.lights.dynamic_row_count;
    if (dynamic_rows > 0) {
        DynamicRow moving = DynamicRows(VIEW.lights.dynamic_rows).at[min(row.cluster, dynamic_rows - 1)];
        set.dynamic_first = moving.first;
        set.dynamic_count = moving.count;
    }
    if (LIGHT_TREE != 0) {
        // a tree of n lights has 2 n - 1 nodes
        set.listed = (VIEW.lights.tree_nodes + 1) / 2 + (VIEW.lights.changing_tree_nodes + 1) / 2;
        set.parent = NO_PARENT;
    }
    return set;
}

LightSet lights_at(vec3 position, vec3 face_normal, vec3 normal) {
    // a surface point lies on the boundary of leaves: step to the side that the surface faces
    uint cell = cell_at(position + face_normal);
    // the row after those of the cells is for points in none
    return lights_of(cell * NORMAL_BINS + (cell < VIEW.lights.cell_count ? normal_bin_of(normal) : 0));
}

// All lights of the map and of the frame.
LightSet all_lights() { return lights_of(VIEW.lights.cell_count * NORMAL_BINS); }

// The same lights with all listed ones in one row: the parent's, which also has some that do not reach the point.
LightSet whole_set(LightSet set) {
    if (set.parent != NO_PARENT) {
        LightRow row = LightRows(VIEW.lights.rows).at[set.parent];
        set.first = row.first;
        set.listed = row.count;
        set.parent = NO_PARENT;
    }
    return set;
}

uint light_kind(uint light) { return light >> LIGHT_KIND_SHIFT; }
uint light_index(uint light) { return light & ((1u << LIGHT_KIND_SHIFT) - 1); }

uint dynamic_light(LightSet set, uint member) { return Indices(VIEW.lights.dynamic_lights).at[set.dynamic_first + member]; }

// A light of a set without a parent by index: listed lights first, then suns, then lights of this frame.
uint light_of_member(LightSet set, uint member) {
    if (member < set.listed) return LightSlots(VIEW.lights.slots).at[set.first + member].light;
    member -= set.listed;
    return member < set.suns ? (LIGHT_SUN << LIGHT_KIND_SHIFT) | member : dynamic_light(set, member - set.suns);
}

TriangleLight triangle_light(uint light) {
    return TriangleLights(VIEW.lights.triangles[light_kind(light) & 1]).at[light_index(light)];
}

SphereLight sphere_light(uint light) {
    return SphereLights(VIEW.lights.spheres[light_kind(light) & 1]).at[light_index(light)];
}

// Solid angle of a triangle of unit vectors (Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983).
float solid_angle(vec3 a, vec3 b, vec3 c) {
    float numerator = abs(dot(a, cross(b, c)));
    float denominator = 1.0 + dot(a, b) + dot(b, c) + dot(c, a);
    return 2.0 * atan(numerator, denominator);
}

// Samples a direction in a spherical triangle of unit vectors uniformly by its solid angle `omega`, which must not be 0
// (Arvo, Stratified Sampling of Spherical Triangles, 1995): moves a corner from a towards c until the partial triangle
// has the fraction u.x of the area, then takes a point on the arc from b to it. The tangent of half a solid angle is a
// quotient of products of its corners (Van Oosterom and Strackee); this gives the tangent of half the arc from a
// without the triangle's angles.
vec3 sample_spherical_triangle(vec3 a, vec3 b, vec3 c, float omega, vec2 u) {
    vec3 along = c - a * dot(a, c);
    float side = length(along);
    float part = 0.5 * omega * u.x;
    float sin_part = sin(part);
    float p = side * (1.0 + dot(a, b)) * sin_part;
    float q = abs(dot(a, cross(b, c))) * cos(part) - dot(b, along) * sin_part;
    // cosine and sine of the arc from the tangent p / q of its half
    float scale = p * p + q * q;
    if (!(scale > 0.0 && side > 0.0)) return a;
    vec3 c_part = a * ((q * q - p * p) / scale) + along * (2.0 * p * q / (scale * side));
    float z = 1.0 - u.y * (1.0 - dot(c_part, b));
    vec3 across = c_part - b * dot(c_part, b);
    float squared = dot(across, across);
    across *= squared > 1.0e-18 ? inversesqrt(squared) : 0.0;
    return z * b + sqrt(max(1.0 - z * z, 0.0)) * across;
}

// Below this solid angle a triangle is sampled by area: the spherical formulas lose precision there.
const float MIN_SOLID_ANGLE = 2.0e-3;

// A direction in the cone around `axis` with the given cosine of its half angle, uniform in solid angle.
vec3 sample_cone(vec3 axis, float cos_angle, vec2 u) {
    vec3 t, b;
    basis(axis, t, b);
    float z = 1.0 - u.x * (1.0 - cos_angle);
    float r = sqrt(max(1.0 - z * z, 0.0));
    float phi = 2.0 * PI * u.y;
    return t * (r * cos(phi)) + b * (r * sin(phi)) + axis * z;
}

// A cosine-weighted direction about n. With this density the estimator of L is the radiance along the ray.
vec3 sample_cosine(vec3 n, vec2 u) {
    vec3 t, b;
    basis(n, t, b);
    float r = sqrt(u.x), phi = 2.0 * PI * u.y;
    return normalize(t * (r * cos(phi)) + b * (r * sin(phi)) + n * sqrt(max(1.0 - u.x, 0.0)));
}

// Part of a sphere light's radiance towards a point in `direction` from it.
float spot_factor(SphereLight light, vec3 direction) {
    if (light.cos_outer <= -2.0) return 1.0;
    float c = dot(light.axis, direction);
    return clamp((c - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1.0e-4), 0.0, 1.0);
}

// A point on a light as seen from a surface. `light`: unshadowed L of the sample, divided by the probability density.
struct LightSample {
    vec3 direction;
    float distance; // to the end of the shadow ray
    vec3 light;
    bool sky; // a sun: its light arrives if the ray hits sky first
};

LightSample no_light() { return LightSample(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), false); }

// Whether shadows are computed from the light's whole surface or from its centre.
bool soft_shadows() { return (VIEW.lights.flags & LIGHTS_SOFT) != 0; }

LightSample sample_triangle(TriangleLight light, vec3 position, vec3 normal, vec2 u) {
    LightSample s = no_light();
    vec3 a = light.corners[0] - position, b = light.corners[1] - position, c = light.corners[2] - position;
    vec3 face = cross(b - a, c - a);
    float double_area = length(face);
    if (double_area <= 0.0) return s;
    face /= double_area;
    float height = dot(a, face); // negative: the emitting side is visible
    if (height >= 0.0 && (light.flags & LIGHT_TWO_SIDED) == 0) return s;
    vec3 ua = safe_normalize(a, vec3(0)), ub = safe_normalize(b, vec3(0)), uc = safe_normalize(c, vec3(0));
    float omega = solid_angle(ua, ub, uc);
    if (!soft_shadows()) {
        vec3 to = (a + b + c) / 3.0;
        s.distance = length(to);
        s.direction = safe_normalize(to, normal);
        s.light = light.radiance * (omega / PI);
    } else if (omega > MIN_SOLID_ANGLE) {
        s.direction = sample_spherical_triangle(ua, ub, uc, omega, u);
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
    if (max_component(s.light) < light.end) s.light = vec3(0.0);
    // ends before the light's own surface
    s.distance -= 0.02 + 2.0e-4 * s.distance;
    return s;
}

// Moves the light along a line to one of 512 points, which are spaced by equal angles as seen from the position (Kulla
// and Fajardo, Importance Sampling Techniques for Path Tracing in Participating Media, 2012). The first nine bits of
// `u` select the point; `u` keeps the others. Returns the uniform density of points on the line over the density of the
// samples.
float choose_on_line(inout SphereLight light, vec3 position, inout float u) {
    const float POINTS = 512.0;
    vec3 to = light.origin - position;
    float nearest = -dot(to, light.axis);
    float height = max(length(to + light.axis * nearest), light.radius);
    float low = atan(-light.half_length - nearest, height), high = atan(light.half_length - nearest, height);
    float at = u * POINTS;
    float beside = height * tan(mix(low, high, (floor(at) + 0.5) / POINTS));
    u = fract(at);
    light.origin += light.axis * (nearest + beside);
    return (high - low) * (height * height + beside * beside) / (2.0 * light.half_length * height);
}

LightSample sample_sphere(SphereLight light, vec3 position, vec3 normal, vec2 u) {
    LightSample s = no_light();
    float share = light.half_length > 0.0 ? choose_on_line(light, position, u.x) : 1.0;
    vec3 to = light.origin - position;
    float squared = dot(to, to);
    float d = sqrt(squared);
    // inside the sphere: a light of the same intensity one radius away
    float sine = min(light.radius / max(d, light.radius), 0.9999);
    float cos_angle = sqrt(1.0 - sine * sine);
    vec3 axis = d > 1.0e-6 ? to / d : normal;
    s.direction = soft_shadows() ? sample_cone(axis, cos_angle, u) : axis;
    float omega = 2.0 * PI * (sine * sine) / (1.0 + cos_angle); // 2 pi (1 - cos) without cancellation
    float cosine = max(dot(normal, s.direction), 0.0);
    s.light = light.radiance * (omega / PI * cosine * spot_factor(light, -axis) * share);
    if (light.reach > 0.0) {
        // 8 I / R^2 (cos - d / R) in place of I cos / d^2
        float part = d / light.reach;
        s.light *= 8.0 * part * part * max(1.0 - part / max(cosine, 1.0e-4), 0.0);
    }
    if (squared < light.core * light.core) s.light *= squared / (light.core * light.core);
    if (max_component(s.light) < light.end) s.light = vec3(0.0);
    s.distance = d - max(light.clearance, light.radius);
    return s;
}

LightSample sample_sun(SunLight light, vec3 normal, vec2 u) {
    LightSample s;
    s.direction = soft_shadows() ? sample_cone(light.direction, light.cos_angle, u) : light.direction;
    s.distance = FAR;
    s.light = light.irradiance * max(dot(normal, s.direction), 0.0);
    s.sky = true;
    return s;
}

LightSample sample_light(uint light, vec3 position, vec3 normal, vec2 u) {
    LightSample s;
    uint kind = light_kind(light);
    if (kind == LIGHT_SUN) s = sample_sun(SunLights(VIEW.lights.suns).at[light_index(light)], normal, u);
    else if (kind >= LIGHT_SPHERE) s = sample_sphere(sphere_light(light), position, normal, u);
    else s = sample_triangle(triangle_light(light), position, normal, u);
    // lights of this frame are scaled already
    if (kind == LIGHT_TRIANGLE || kind == LIGHT_SPHERE || kind == LIGHT_SUN) s.light *= VIEW.lights.scale;
    return s;
}

// Approximate light of a triangle that is large as seen from the point.
float large_triangle_target(uint light, vec3 position, vec3 normal) {
    TriangleLight triangle = triangle_light(light);
    vec3 a = triangle.corners[0] - position, b = triangle.corners[1] - position, c = triangle.corners[2] - position;
    vec3 ua = safe_normalize(a, normal), ub = safe_normalize(b, normal), uc = safe_normalize(c, normal);
    float cosine = max(dot(normal, ua), 0.0) + max(dot(normal, ub), 0.0) + max(dot(normal, uc), 0.0);
    return luminance(triangle.radiance) * max(solid_angle(ua, ub, uc), 1.0e-6) * (cosine / 3.0) / PI;
}

// Target function of resampling, for all lights but suns: approximate luminance without shadows. Zero only where the
// light contributes nothing (below the horizon, behind the light, outside of its cone), so that no light is lost.
float light_target(uint light, vec3 position, vec3 normal) {
    uint kind = light_kind(light);
    LightBounds bounds = LightBoundsArray(VIEW.lights.bounds[kind]).at[light_index(light)];
    vec3 to = bounds.centre - position;
    float squared = dot(to, to), aloft = dot(normal, to);
    if (aloft + bounds.radius <= 0.0) return 0.0;
    float inverse = inversesqrt(max(squared, 1.0e-6));
    float scale = kind == LIGHT_TRIANGLE || kind == LIGHT_SPHERE ? VIEW.lights.scale : 1.0;
    float towards = bounds.omni_intensity;
    if (towards <= 0.0) {
        float facing = -dot(bounds.axis, to);
        if (towards < 0.0) facing = abs(facing);
        if (facing <= 0.0) return 0.0;
        if (bounds.radius * bounds.radius * 4.0 > squared) {
            float target = large_triangle_target(light, position, normal);
            // zero only if every corner is below the horizon
            return target * scale;
        }
        towards = facing * inverse / PI;
    } else if (bounds.axis != vec3(0.0)) {
        float stretch = length(bounds.axis);
        // slightly wider than the cone
        if (-dot(bounds.axis, to) * inverse < (stretch - 2.0 - 1.0e-3) * stretch) return 0.0;
    }
    // keeps a part of a light that the horizon cuts
    float cosine = clamp(max(aloft, 0.25 * (aloft + bounds.radius)) * inverse, 0.0, 1.0);
    return towards * scale * cosine / max(squared, 0.25 * bounds.radius * bounds.radius);
}

// A selected light, and the factor of its light; weight 0: none.
struct LightChoice {
    uint light;
    float weight;
    float total; // approximate unshadowed light of all candidates; of resampled choices only
};

// Selects one light of a set without a parent, each with about the same probability. `u`, here and below: uniform
// before and after (see `rng_decide`), so that with a second number it samples the point on the light.
LightChoice sample_uniform(LightSet set, inout float u) {
    uint count = set_count(set), length = uint(findMSB(count));
    if (length > 13) {
        uint member = rng_pick(u, count);
        return LightChoice(light_of_member(set, member), float(count), 0.0);
    }
    // Probabilities are multiples of a power of 1/2 that is four to eight times finer than 1 / count. The points of a
    // sequence over frames are spread evenly over such intervals, so each light gets exactly its share of the frames.
    uint parts = 8u << length, member = (uint(u * float(parts)) * count) >> (length + 3);
    uint first = (member * parts + count - 1) / count, next = ((member + 1) * parts + count - 1) / count;
    u = min((u * float(parts) - float(first)) / float(next - first), 1.0 - 1.0 / 16777216.0);
    return LightChoice(light_of_member(set, member), float(parts) / float(next - first), 0.0);
}

// Selects one of the suns; most maps have one.
LightChoice sample_sun(uint count, inout float u) {
    uint index = count > 1 ? rng_pick(u, count) : 0;
    return LightChoice((LIGHT_SUN << LIGHT_KIND_SHIFT) | index, float(count), 0.0);
}

// A drawn light of a row.
struct ListedLight {
    uint light;
    float chance; // probability of the light
    float visibility;
};

float slot_visibility(LightSlot slot) { return unpackUnorm2x16(slot.fractions).y; }

// Draws a slot of a row by its alias table (Walker 1977).
LightSlot draw_slot(uint first, uint count, float u) {
    LightSlots slots = LightSlots(VIEW.lights.slots);
    LightSlot slot = slots.at[first + rng_pick(u, count)];
    if (u < unpackUnorm2x16(slot.fractions).x) return slot;
    return slots.at[first + slot.alias];
}

// The slot of a light in a set's row, if the row states the light.
bool find_slot(LightSet set, uint light, inout LightSlot slot) {
    LightSlots slots = LightSlots(VIEW.lights.slots);
    uint low = 0, high = set.listed;
    while (low < high) {
        uint middle = (low + high) / 2;
        if (slots.at[set.first + middle].light < light) low = middle + 1;
        else high = middle;
    }
    if (low >= set.listed) return false;
    LightSlot found = slots.at[set.first + low];
    if (found.light != light) return false;
    slot = found;
    return true;
}

// Draws a listed light: of PARENT_DRAWS equal parts of [0, 1), the first draws from the parent.
ListedLight draw_listed(LightSet set, float u) {
    LightSlot slot;
    if (set.parent == NO_PARENT) slot = draw_slot(set.first, set.listed, u);
    else {
        if (!rng_decide(u, 1.0 / float(PARENT_DRAWS))) slot = draw_slot(set.first, set.listed, u);
        else {
            LightRow parent = LightRows(VIEW.lights.rows).at[set.parent];
            slot = draw_slot(parent.first, parent.count, u);
            slot.chance /= float(PARENT_DRAWS);
            // of a stated light the row has the probability by both ways
            find_slot(set, slot.light, slot);
        }
    }
    return ListedLight(slot.light, slot.chance, slot_visibility(slot));
}

// Resampled importance sampling (Talbot et al. 2005): draws candidates, selects one by its target, and weights it by
// the inverse of its probability. Candidates come from the row's list by alias tables, with probabilities from the
// light's contribution in the cell to surfaces of this normal bin, shadows included; a short list is taken whole. With
// LIGHT_TREE each candidate is drawn by a descent of the tree.
// Lights of this frame are candidates by themselves. Suns have a ray of their own: an occluded sun would outweigh all
// lights that reach its shadow.
LightChoice sample_resampled(LightSet set, vec3 position, vec3 normal, inout float u) {
    uint candidates = max(VIEW.lights.candidates, 1);
    bool whole = LIGHT_TREE == 0 && set.parent == NO_PARENT && set.listed <= candidates;
    uint drawn = LIGHT_TREE != 0 ? min(set.listed, candidates) : whole ? set.listed : candidates, drawn_dynamic = min(set.dynamic_count, candidates);
    float sum = 0.0, selected_target = 0.0;
    float offset = whole ? 0.0 : rng_next(), dynamic_offset = set.dynamic_count > drawn_dynamic ? rng_next() : 0.0;
    uint selected = 0;
    for (uint i = 0; i < drawn + drawn_dynamic; i++) {
        // decisions consume the digits of a number; renewed every 8 candidates
        if (i > 0 && i % 8 == 0) u = rng_next();
        uint light;
        float weight = 1.0, visibility = 1.0;
        if (i < drawn) {
            if (LIGHT_TREE != 0) {
                float chance;
                if (!draw_from_tree(position, normal, (float(i) + offset) / float(drawn), light, chance)) continue;
                weight = 1.0 / (chance * float(drawn));
            } else if (whole) {
                LightSlot slot = LightSlots(VIEW.lights.slots).at[set.first + i];
                light = slot.light;
                visibility = slot_visibility(slot);
            } else {
                // one random number offsets all candidates, each in its part of the list
                ListedLight listed = draw_listed(set, (float(i) + offset) / float(drawn));
                light = listed.light;
                visibility = listed.visibility;
                weight = 1.0 / (listed.chance * float(drawn));
            }
        } else {
            uint member = i - drawn;
            if (set.dynamic_count > drawn_dynamic) {
                float within = (float(member) + dynamic_offset) / float(drawn_dynamic);
                member = rng_pick(within, set.dynamic_count);
                weight = float(set.dynamic_count) / float(drawn_dynamic);
            }
            light = dynamic_light(set, member);
        }
        float target = light_target(light, position, normal) * visibility;
        if (!(target > 0.0)) continue;
        sum += target * weight;
        if (rng_decide(u, target * weight / sum)) {
            selected = light;
            selected_target = target;
        }
    }
    return LightChoice(selected, selected_target > 0.0 ? sum / selected_target : 0.0, sum);
}

// The same of those lights that only the parent of the set's row has.
LightChoice sample_parent(LightSet set, vec3 position, vec3 normal, inout float u) {
    LightRow parent = LightRows(VIEW.lights.rows).at[set.parent];
    uint candidates = max(VIEW.lights.candidates, 1);
    float sum = 0.0, selected_target = 0.0, offset = rng_next();
    uint selected = 0;
    for (uint i = 0; i < candidates; i++) {
        LightSlot slot = draw_slot(parent.first, parent.count, (float(i) + offset) / float(candidates)), stated;
        float target = light_target(slot.light, position, normal) * slot_visibility(slot);
        if (!(target > 0.0) || find_slot(set, slot.light, stated)) continue;
        float weight = 1.0 / (slot.chance * float(candidates));
        sum += target * weight;
        if (rng_decide(u, target * weight / sum)) {
            selected = slot.light;
            selected_target = target;
        }
    }
    return LightChoice(selected, selected_target > 0.0 ? sum / selected_target : 0.0, sum);
}

// Selects a listed light or a sun, for points with a single ray: by their approximate unshadowed light, each with a
// probability of at least 1/4, because their visibility is unknown here.
LightChoice sample_one(LightSet set, vec3 position, vec3 normal, inout float u) {
    LightChoice listed = sample_resampled(set, position, normal, u);
    if (set.suns == 0) return listed;
    LightChoice sun = sample_sun(set.suns, u);
    SunLight light = SunLights(VIEW.lights.suns).at[light_index(sun.light)];
    // the disc's edge may be above the horizon while its centre is below
    float aloft = dot(normal, light.direction) + sqrt(max(1.0 - light.cos_angle * light.cos_angle, 0.0));
    if (aloft <= 0.0) return listed;
    if (!(listed.weight > 0.0)) return sun;
    float sun_target = luminance(light.irradiance) * VIEW.lights.scale * min(aloft, 1.0) * sun.weight;
    float chance = clamp(sun_target / (sun_target + listed.total), 0.25, 0.75);
    if (rng_decide(u, chance)) return LightChoice(sun.light, sun.weight / chance, sun.total);
    return LightChoice(listed.light, listed.weight / (1.0 - chance), listed.total);
}

// Selects one light of a set for a surface point. `u`: samples a point on it.
LightChoice one_choice(LightSet set, vec3 position, vec3 normal, out vec2 u) {
    u = vec2(0.0);
    if (set_count(set) == 0) return LightChoice(0, 0.0, 0.0);
    u = rng_next2();
    if (VIEW.lights.selection == SELECT_UNIFORM) return sample_uniform(whole_set(set), u.x);
    return sample_one(set, position, normal, u.x);
}

// The same, and a point on it.
LightSample one_light(LightSet set, vec3 position, vec3 normal) {
    vec2 u;
    LightChoice choice = one_choice(set, position, normal, u);
    if (!(choice.weight > 0.0)) return no_light();
    LightSample s = sample_light(choice.light, position, normal, u);
    s.light *= choice.weight;
    return s;
}

#endif
