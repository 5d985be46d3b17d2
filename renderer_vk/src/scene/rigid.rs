//! Surfaces of models in one key frame: what looks the same in every frame is evaluated once and shared.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use shaders::types::Vertex;

/// Views after which a mesh that was not drawn is forgotten.
const KEPT: u64 = 1000;

/// A surface of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId {
    /// Handle of the model.
    pub model: i32,
    /// Level of detail.
    pub level: u32,
    /// Index of the surface.
    pub surface: u32,
}

/// A surface that keeps its shape, in the space of its instance.
#[derive(Debug)]
pub struct RigidMesh {
    /// No other mesh has it.
    pub id: u64,
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Indices into `vertices`, three a triangle.
    pub indices: Vec<u32>,
}

impl RigidMesh {
    /// A mesh of its own.
    pub fn new(vertices: Vec<Vertex>, indices: Vec<u32>) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            vertices,
            indices,
        }
    }
}

/// How much of a mesh is the same from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// Nothing: polygons, sprites, beams.
    #[default]
    Changing,
    /// Its triangles; the vertices are somewhere else: key frames between which it is drawn, bones.
    Animated(MeshId),
    /// Everything: this index of [`TracedPart::rigid`](super::look::TracedPart::rigid), which has its vertices and
    /// indices; the mesh's own ranges are empty.
    Rigid(u32),
}

/// The meshes that keep their shape, by what they show.
#[derive(Debug, Default)]
pub(super) struct RigidMeshes {
    entries: HashMap<(MeshId, usize), Entry>,
    view: u64,
}

#[derive(Debug)]
struct Entry {
    /// Number of the view that it was last asked for in.
    seen: u64,
    mesh: Option<Arc<RigidMesh>>,
}

impl RigidMeshes {
    /// Another view begins.
    pub fn begin_view(&mut self) {
        self.view += 1;
        if self.view.is_multiple_of(KEPT) {
            let view = self.view;
            self.entries.retain(|_, entry| view - entry.seen <= KEPT);
        }
    }

    /// The mesh of a surface in a key frame. `only`: the model has no other frame; otherwise the frame has to rest for
    /// two views to be one that is kept, so that nothing is kept of an animation whose frames pass by.
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
            // asked for twice in one view it has not rested longer
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
