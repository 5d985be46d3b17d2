//! Parts of a view that one look reads.

use std::sync::Arc;

use super::{
    DebugPolygons, DrawSurface, Portal, RigidMesh, ShadowVolumes, Statistics, Submodel, ViewEntity,
    ViewScene, VisibleSky,
};

/// A view of the classic look: the sorted surfaces in the frustum. A portal or mirror has a view of its own.
pub type ClassicScene = ViewScene<ClassicPart>;

/// A view of the traced look: all moving geometry, in the frustum or not.
pub type TracedScene = ViewScene<TracedPart>;

/// Data for the classic look.
#[derive(Clone, Debug, Default)]
pub struct ClassicPart {
    /// Visible surfaces in drawing order.
    pub surfaces: Vec<DrawSurface>,
    /// Visible skies, one for each pair of material and fog.
    pub skies: Vec<VisibleSky>,
    /// Shadow volumes of models (`cg_shadows 2`).
    pub shadows: ShadowVolumes,
    /// Debug polygons of the engine's collision code (`r_debugSurface`).
    pub debug: DebugPolygons,
    /// Counts for `r_speeds`.
    pub statistics: Statistics,
}

/// Data for the traced look.
#[derive(Clone, Debug, Default)]
pub struct TracedPart {
    /// Rigid meshes, see [`Shape::Rigid`](super::Shape::Rigid); meshes of the view share them.
    pub rigid: Vec<Arc<RigidMesh>>,
    /// Inline models.
    pub submodels: Vec<Submodel>,
    /// Entities that added geometry, in the game's order.
    pub entities: Vec<ViewEntity>,
    /// Numbers of the world's surfaces in the visible set, which may show through a sky.
    pub potential: Vec<u32>,
    /// Portals and mirrors that rays may hit.
    pub portals: Vec<Portal>,
}

/// The part of a view for one look, for code that gathers views of both.
pub trait LookPart {
    /// The part, for writing.
    fn part(&mut self) -> LookPartMut<'_>;

    /// Empties it, but keeps its buffers.
    fn clear(&mut self);
}

/// The part of a view, by look.
pub enum LookPartMut<'a> {
    /// Of a view of the classic look.
    Classic(&'a mut ClassicPart),
    /// Of a view of the traced look.
    Traced(&'a mut TracedPart),
}

impl LookPart for ClassicPart {
    fn part(&mut self) -> LookPartMut<'_> {
        LookPartMut::Classic(self)
    }

    fn clear(&mut self) {
        self.surfaces.clear();
        self.skies.clear();
        self.shadows.clear();
        self.debug.clear();
        self.statistics = Statistics::default();
    }
}

impl LookPart for TracedPart {
    fn part(&mut self) -> LookPartMut<'_> {
        LookPartMut::Traced(self)
    }

    fn clear(&mut self) {
        self.rigid.clear();
        self.submodels.clear();
        self.entities.clear();
        self.potential.clear();
        self.portals.clear();
    }
}
