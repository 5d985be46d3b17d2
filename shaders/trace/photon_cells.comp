#version 460
// Sorts the photons of a frame into the cells of a hash grid: a list for each. A pass of its own, so that the order of a
// list does not depend on the time that a photon's path took.
#include "trace/photons.glsl"

layout(local_size_x = 32) in;

void main() {
    uint number = gl_GlobalInvocationID.y * PHOTON_ROW + gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= PHOTON_ROW || number >= VIEW.photons.count) return;
    Photons photons = Photons(VIEW.photons.photons);
    if (photons.at[number].flux == vec3(0.0)) return;
    uint cell = photon_cell(photon_place(photons.at[number].position));
    PhotonCells cells = PhotonCells(VIEW.photons.cells);
    atomicAdd(cells.at[cell].count, 1);
    photons.at[number].next = atomicExchange(cells.at[cell].first, number + 1);
}
