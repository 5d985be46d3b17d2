//! Triangles of a part, collected from its meshes.

use glam::Vec3;
use shaders::types::Vertex;
use support::slice;

use super::cutout::Coverage;
use super::input::Kind;
use super::parts::{Part, Parts, Share};
use crate::gpu::BlasGeometry;
use crate::scene::{MeshGeometry, TracedScene};

/// The geometry of one mesh of a part.
pub struct MeshPart<'a> {
    /// Its vertices and indices.
    pub mesh: MeshGeometry<'a>,
    /// Index of its first vertex in the part.
    pub offset: u32,
    /// The triangles of the mesh that the part takes, with the coverage of each; `None`: all.
    pub taken: Option<(Coverage, &'a [Coverage])>,
}

impl MeshPart<'_> {
    /// Triangles, as vertex indices in the part.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let offset = self.offset;
        let takes = |place: usize| match self.taken {
            Some((wanted, all)) => all.get(place) == Some(&wanted),
            None => true,
        };
        (self.mesh.triangles().enumerate())
            .filter(move |(place, _)| takes(*place))
            .map(move |(_, t)| t.map(|i| i + offset))
    }
}

/// The meshes of a part.
pub fn members<'a>(view: &'a TracedScene, parts: &'a Parts, part: &Part) -> Vec<MeshPart<'a>> {
    let members = part.members.clone();
    let meshes = slice::part(&parts.meshes, members.clone());
    let skins = slice::part(&parts.skins, members);
    // an absent mesh is replaced by an empty one, so that meshes and skins keep equal indices
    const NOTHING: MeshGeometry<'_> = MeshGeometry {
        vertices: &[],
        indices: &[],
        base: 0,
    };
    let found = meshes.iter().zip(skins).map(|(&mesh, skin)| MeshPart {
        mesh: view
            .meshes
            .get(mesh)
            .map_or(NOTHING, |mesh| view.mesh_geometry(mesh)),
        offset: skin.shape.first_vertex,
        taken: parts.coverages(skin).map(|all| {
            let wanted = match skin.shape.share {
                Share::Solid(_) => Coverage::Solid,
                Share::Whole | Share::Mixed(_) => Coverage::Mixed,
            };
            (wanted, all)
        }),
    });
    found.collect()
}

/// All triangles of a part.
pub fn part_indices(meshes: &[MeshPart<'_>]) -> Vec<[u32; 3]> {
    meshes.iter().flat_map(MeshPart::triangles).collect()
}

/// Whether `indices` equal the triangles of these meshes.
pub fn is_same(indices: &[[u32; 3]], meshes: &[MeshPart<'_>]) -> bool {
    let now = meshes.iter().flat_map(MeshPart::triangles);
    now.eq(indices.iter().copied())
}

/// Corner positions of triangles.
pub fn part_corners(vertices: &[Vertex], indices: &[[u32; 3]]) -> Vec<[Vec3; 3]> {
    let position = |i: u32| vertices.get(i as usize).map_or(Vec3::NAN, |v| v.position);
    indices.iter().map(|t| t.map(position)).collect()
}

/// A part's triangles as build input of the driver; `vertices` and `triangles` are counts.
pub fn geometry(
    kind: Kind,
    vertex_address: u64,
    vertices: usize,
    index_address: u64,
    triangles: usize,
) -> BlasGeometry {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    BlasGeometry {
        vertex_address,
        vertex_stride: size_of::<Vertex>() as u64,
        max_vertex: count(vertices.saturating_sub(1)),
        index_address,
        triangle_count: count(triangles),
        opaque: kind.is_untested(),
        no_duplicate_any_hit: kind == Kind::Translucent,
    }
}
