// Light that photons bring to a point through refracting bodies: a density estimate (Jensen, Global Illumination using
// Photon Maps, 1996) over the photons of this frame, which a hash grid holds.
//
// Photons count where the last surface of a body on their way has let them through, or has reflected them inside of the
// body. Light that a body reflects outside comes from light across mirrors and from bounces, as it does without photons.
//
// The side of a cell is the diameter of the kernel, so that a kernel touches eight cells at most. The radius shrinks from
// frame to frame (`renderer_vk/src/trace/photons.rs`), so that the mean over frames converges.
#ifndef RELIGHT_TRACE_PHOTONS_GLSL
#define RELIGHT_TRACE_PHOTONS_GLSL

#include "trace/geometry.glsl"
#include "trace/random.glsl"
#include "trace/direction.glsl"

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Photons { Photon at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer PhotonCells { PhotonCell at[]; };

// 1: photons bring the light that crosses refracting bodies. 0 removes the code.
layout(constant_id = 4) const uint CAUSTICS = 0;

// Whether photons bring the light of lamps and suns that the surface of a body reflects along a ray.
bool photons_mirror(SurfacePoint p, vec3 direction) {
    return CAUSTICS != 0 && (p.triangle.flags & TRIANGLE_BODY) != 0 && dot(p.face_normal, direction) > 0.0;
}

// Most photons of a cell that an estimate reads. They stand for the others: their order in the list is random.
const uint MOST_PHOTONS = 256;
// Least cosine between the normals of a point and of a photon that counts there.
const float SAME_SURFACE = 0.7;
// Bound of the factor of a shading normal, where a photon grazes the geometry.
const float MOST_TURNED = 4.0;

// The cell of a point.
ivec3 photon_place(vec3 position) { return ivec3(floor(position / (2.0 * VIEW.photons.radius))); }

// Index of a cell. The eight cells of a block are never in one place, so that no estimate reads a photon twice.
uint photon_cell(ivec3 place) {
    uvec3 block = uvec3(place >> 1), within = uvec3(place & 1);
    uint hash = pcg_hash(block.x + pcg_hash(block.y + pcg_hash(block.z)));
    return (hash << 3 | within.z << 2 | within.y << 1 | within.x) & (VIEW.photons.cell_count - 1);
}

// L of the photons at a point, with Epanechnikov's kernel.
vec3 photon_light(vec3 position, vec3 face_normal, vec3 normal) {
    float squared = VIEW.photons.radius * VIEW.photons.radius;
    ivec3 low = photon_place(position - VIEW.photons.radius);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 8; i++) {
        PhotonCell cell = PhotonCells(VIEW.photons.cells).at[photon_cell(low + ivec3(i & 1, i >> 1 & 1, i >> 2))];
        uint read = min(cell.count, MOST_PHOTONS), next = cell.first;
        vec3 found = vec3(0.0);
        for (uint n = 0; n < read; n++) {
            Photon photon = Photons(VIEW.photons.photons).at[next - 1];
            next = photon.next;
            vec3 away = photon.position - position, from = -unpack_normal(photon.direction);
            float part = 1.0 - dot(away, away) / squared, cosine = dot(face_normal, from);
            if (!(part > 0.0 && cosine > 0.0) || dot(face_normal, unpack_normal(photon.normal)) < SAME_SURFACE) continue;
            // photons are as dense as the geometry has irradiance
            float turned = normal == face_normal ? 1.0 : min(max(dot(normal, from), 0.0) / cosine, MOST_TURNED);
            found += photon.flux * (part * turned);
        }
        if (read > 0) sum += found * (float(cell.count) / float(read));
    }
    return sum * (2.0 / (PI * squared));
}

#endif
