//! Parts of a view that a single look reads.

use std::sync::Arc;

use super::{
    DebugPolygons, DrawSurface, Portal, RigidMesh, ShadowVolumes, Statistics, Submodel, ViewEntity,
    ViewScene, VisibleSky,
};

/// A view that is rasterized: the surfaces in the frustum, sorted; a portal or mirror has its own view.
pub type ClassicScene = ViewScene<ClassicPart>;

/// A view that is traced: all moving geometry, in sight or not.
pub type TracedScene = ViewScene<TracedPart>;

/// Data for the classic look alone.
#[derive(Clone, Debug, Default)]
pub struct ClassicPart {
    /// Visible surfaces in drawing order.
    pub surfaces: Vec<DrawSurface>,
    /// The skies in sight, each material once with each fog.
    pub skies: Vec<VisibleSky>,
    /// Shadow volumes of models (`cg_shadows 2`).
    pub shadows: ShadowVolumes,
    /// Debug polygons of the engine's collision code (`r_debugSurface`).
    pub debug: DebugPolygons,
    /// Counts for `r_speeds`.
    pub statistics: Statistics,
}

/// Data for the traced look alone.
#[derive(Clone, Debug, Default)]
pub struct TracedPart {
    /// Meshes that keep their shape, see [`Shape::Rigid`](super::Shape::Rigid); one may occur many times.
    pub rigid: Vec<Arc<RigidMesh>>,
    /// Inline models.
    pub submodels: Vec<Submodel>,
    /// The entities that added something, in the game's order.
    pub entities: Vec<ViewEntity>,
    /// Numbers of the world's surfaces in the visible set: those that show through a sky.
    pub potential: Vec<u32>,
    /// Portals and mirrors that the view may meet.
    pub portals: Vec<Portal>,
}

/// A look's part of a view, for code that gathers views of both looks.
pub trait LookPart {
    /// The part, to be filled.
    fn part(&mut self) -> LookPartMut<'_>;

    /// Empties it; its memory is used again.
    fn clear(&mut self);
}

/// A look's part of a view, by the look.
pub enum LookPartMut<'a> {
    /// The view is rasterized.
    Classic(&'a mut ClassicPart),
    /// The view is traced.
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
