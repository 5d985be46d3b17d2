//! Shares the vertices of models that rest in one key frame.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use shaders::types::Vertex;
use support::Aabb;

/// Number of views after which an undrawn mesh is dropped.
const KEPT: u64 = 1000;

/// Identifies a surface of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId {
    /// Handle of the model.
    pub model: i32,
    /// Level of detail.
    pub level: u32,
    /// Index of the surface.
    pub surface: u32,
}

/// A surface of constant shape, in the space of its instance.
#[derive(Debug)]
pub struct RigidMesh {
    /// Unique id.
    pub id: u64,
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Indices into `vertices`, three a triangle.
    pub indices: Vec<u32>,
    /// Bounds of the finite vertices.
    pub bounds: Aabb,
}

impl RigidMesh {
    /// A mesh with a new id.
    pub fn new(vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            bounds: finite_bounds(&vertices),
            vertices,
            indices,
        }
    }
}

/// Bounds of the finite vertices.
pub fn finite_bounds(vertices: &[Vertex]) -> Aabb {
    let positions = vertices.iter().map(|v| v.position);
    Aabb::of(positions.filter(|p| p.is_finite()))
}

/// Part of a mesh that stays the same from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// Nothing: polygons, sprites, beams.
    #[default]
    Changing,
    /// The triangles; vertices move by key frames, bones or deformations.
    Animated(MeshId),
    /// Everything: the index in [`TracedPart::rigid`](super::look::TracedPart::rigid); the mesh's own ranges are empty.
    Rigid(u32),
}

/// Rigid meshes by surface and key frame.
#[derive(Debug, Default)]
pub(super) struct RigidMeshes {
    entries: HashMap<(MeshId, usize), Entry>,
    view: u64,
}

#[derive(Debug)]
struct Entry {
    /// Number of the last view that requested it.
    seen: u64,
    mesh: Option<Arc<RigidMesh>>,
}

impl RigidMeshes {
    /// Begins a view.
    pub fn begin_view(&mut self) {
        self.view += 1;
        if self.view.is_multiple_of(KEPT) {
            let view = self.view;
            self.entries.retain(|_, entry| view - entry.seen <= KEPT);
        }
    }

    /// The mesh of a surface in a key frame. `only`: the model has no other frame. Otherwise the mesh is made when two
    /// successive views have requested it, so that no frame of a running animation is stored.
    pub fn get(
        &mut self,
        id: MeshId,
        frame: usize,
        only: bool,
        make: impl FnOnce() -> (Vec<Vertex>, Vec<u32>),
    ) -> Option<Arc<RigidMesh>> {
        let view = self.view;
        let entry = self.entries.entry((id, frame)).or_insert(Entry {
            seen: 0,
            mesh: None,
        });
        let rests = only || (entry.seen > 0 && view - entry.seen <= 1);
        if entry.seen != view {
            // a second request in the same view does not count
            if rests && entry.mesh.is_none() {
                let (vertices, indices) = make();
                entry.mesh = Some(Arc::new(RigidMesh::new(vertices, indices)));
            }
            entry.seen = view;
        }
        entry.mesh.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_kept_once_it_rests() {
        let mut meshes = RigidMeshes::default();
        let id = MeshId {
            model: 3,
            level: 0,
            surface: 1,
        };
        let made = || (vec![Vertex::default(); 3], vec![0, 1, 2]);
        meshes.begin_view();
        assert!(meshes.get(id, 5, false, made).is_none());
        assert!(meshes.get(id, 5, false, made).is_none());
        let only = meshes.get(id, 0, true, made).expect("kept at once");
        meshes.begin_view();
        let first = meshes.get(id, 5, false, made).expect("rests");
        let again = meshes.get(id, 5, false, || unreachable!()).expect("kept");
        assert_eq!(first.id, again.id);
        assert_ne!(first.id, only.id);
        // another frame of the same surface is another mesh
        assert!(meshes.get(id, 6, false, made).is_none());
        for _ in 0..2 * KEPT {
            meshes.begin_view();
        }
        assert!(meshes.entries.is_empty());
    }
}
