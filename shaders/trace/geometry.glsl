// Computes the surface point of a hit.
#ifndef RELIGHT_TRACE_GEOMETRY_GLSL
#define RELIGHT_TRACE_GEOMETRY_GLSL

#include "common/tangent_space.glsl"
#include "trace/view.glsl"

const uint NO_HIT = 0xFFFFFFFFu;

// A hit as the tracers report it. `geometry`: index of the geometry record; NO_HIT: the ray hit nothing.
struct Hit {
    uint geometry;
    uint primitive;
    vec2 barycentrics;
    float t;
};

// A point on a triangle. Positions and normals of `stage` are in the space of the instance, all others in world space.
struct SurfacePoint {
    Triangle triangle;
    uint instance;
    uint kind;
    vec3 position;
    vec3 face_normal;   // unit, on the front side (clockwise corners)
    vec3 normal;        // unit, interpolated
    float texel_scale;  // texture coordinates per unit of length
    uint64_t vertices;  // address of the geometry's vertices
    vec3 weights;       // barycentric, of the triangle's corners
    StagePoint stage;
};

Instance instance_of(uint index) { return TraceInstances(VIEW.scene.instances).at[index]; }
Material material_of(uint index) { return Materials(VIEW.materials.materials).at[index]; }

// Two unit vectors perpendicular to n (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
void basis(vec3 n, out vec3 t, out vec3 b) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float c = n.x * n.y * a;
    t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
    b = vec3(c, s + n.y * n.y * a, -n.y);
}

SurfacePoint surface_point(Hit hit) {
    GeometryRecord record = Geometries(VIEW.scene.geometries).at[hit.geometry];
    SurfacePoint p;
    p.triangle = Triangles(record.triangles).at[hit.primitive];
    p.instance = record.instance != NO_INSTANCE ? record.instance : p.triangle.instance;
    p.kind = record.kind;
    p.vertices = record.vertices;
    TraceVertices vertices = TraceVertices(record.vertices);
    Vertex a = vertices.at[p.triangle.indices[0]];
    Vertex b = vertices.at[p.triangle.indices[1]];
    Vertex c = vertices.at[p.triangle.indices[2]];
    vec3 w = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    p.weights = w;
    Instance instance = instance_of(p.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);

    p.stage.position = a.position * w.x + b.position * w.y + c.position * w.z;
    // corners are clockwise seen from the front
    vec3 local_face = cross(c.position - a.position, b.position - a.position);
    p.stage.normal = safe_normalize(a.normal * w.x + b.normal * w.y + c.normal * w.z, safe_normalize(local_face, vec3(0, 0, 1)));
    p.stage.st = a.st * w.x + b.st * w.y + c.st * w.z;
    p.stage.lightmap = a.lightmap * w.x + b.lightmap * w.y + c.lightmap * w.z;
    p.stage.color = unpackUnorm4x8(a.color) * w.x + unpackUnorm4x8(b.color) * w.y + unpackUnorm4x8(c.color) * w.z;
    p.stage.identity_light = 1.0;
    p.stage.time = shader_time(material_of(p.triangle.material), instance);

    p.position = axis * p.stage.position + instance.origin;
    vec3 ab = axis * (b.position - a.position);
    vec3 ac = axis * (c.position - a.position);
    vec3 face = cross(ac, ab);
    float double_area = length(face);
    p.face_normal = double_area > 0.0 ? face / double_area : vec3(0, 0, 1);
    p.normal = safe_normalize(axis * p.stage.normal, p.face_normal);
    vec2 sb = b.st - a.st, sc = c.st - a.st;
    float double_st = abs(sb.x * sc.y - sb.y * sc.x);
    p.texel_scale = double_area > 0.0 ? sqrt(double_st / double_area) : 0.0;
    p.stage.view_distance = distance(p.position, VIEW.camera.origin);
    return p;
}

// Whether the material culls the side that the ray hits.
bool is_culled(SurfacePoint p, vec3 direction) {
    uint material_flags = material_of(p.triangle.material).flags;
    if ((material_flags & MATERIAL_TWO_SIDED) != 0 || (p.triangle.flags & (TRIANGLE_FACES_CAMERA | TRIANGLE_SOLID)) != 0) return false;
    bool from_front = dot(p.face_normal, direction) < 0.0;
    return from_front == ((material_flags & MATERIAL_CULL_BACK) != 0);
}

// Largest offset of `shading_position`, units. Bounds the error where a mesh has the normals of a curve but is not one, as
// a box with smooth normals.
const float MAX_SHADING_OFFSET = 4.0;

// The point from which a surface gathers light: on curves and models offset to the surface that the vertex normals imply,
// so that facets cast no shadow on their own surface along the terminator (Hanika, Hacking the Shadow Terminator, Ray
// Tracing Gems II, chapter 4). `face`: the side. Where the surface is concave on that side, the offset is 0.
vec3 shading_position(SurfacePoint p, vec3 face) {
    if ((p.triangle.flags & TRIANGLE_CURVED) == 0) return p.position;
    TraceVertices vertices = TraceVertices(p.vertices);
    Instance instance = instance_of(p.instance);
    mat3 axis = mat3(instance.axis[0], instance.axis[1], instance.axis[2]);
    float side = dot(p.face_normal, face) < 0.0 ? -1.0 : 1.0;
    vec3 moved = vec3(0.0);
    for (uint i = 0; i < 3; i++) {
        Vertex corner = vertices.at[p.triangle.indices[i]];
        vec3 normal = side * safe_normalize(axis * corner.normal, vec3(0.0));
        float above = dot(p.position - (axis * corner.position + instance.origin), normal);
        moved -= p.weights[i] * min(above, 0.0) * normal;
    }
    float offset = length(moved);
    return p.position + moved * min(1.0, MAX_SHADING_OFFSET / max(offset, 1.0e-6));
}

// The mirror direction about a shading normal, or about the geometric normal `face` if that would lead into the surface.
vec3 mirror_direction(vec3 direction, vec3 face, vec3 normal) {
    vec3 mirrored = reflect(direction, normal);
    return normalize(dot(mirrored, face) > 0.0 ? mirrored : reflect(direction, face));
}

// Start of a ray that leaves the surface on the side of `normal`: offset so that rounding cannot make it hit the
// surface again (Wachter and Binder, A Fast and Robust Method for Avoiding Self-Intersection, scaled to coordinates).
vec3 offset_ray(vec3 position, vec3 normal) {
    vec3 m = abs(position);
    return position + normal * (0.02 + 1.0e-5 * max(m.x, max(m.y, m.z)));
}

#endif
