//! A relit map: flat geometry, resolved materials, light sources.

pub mod coplanar;
pub(crate) mod fog;
pub(crate) mod geometry;
mod holes;
mod lighting;
pub(crate) mod material;
pub(crate) mod pages;

pub use crate::emitters::StyleStrength;
pub use fog::WorldFog;
pub use geometry::{Flare, NO_LIGHT, WorldModel, WorldSurface, WorldVertex};
pub use holes::Holes;
pub use lighting::Lighting;
pub use material::WorldMaterial;
pub use pages::{BakedPages, StyleLight};

use crate::emitters::{
    CalibrationReport, Flicker, LightColor, LightLists, LightReport, PointLight, SunLight,
    TriangleLight,
};
use crate::exposure::{self, Exposure};
use crate::materials::by_hand::MaterialsByHand;
use crate::overbright;
use glam::Vec3;
use q3bsp::{Bsp, Lightmap, SurfaceKind};
use support::slice::{self, item, part, part_mut, span};

/// A map prepared for tracing and rasterization.
///
/// `surfaces` has one entry per surface of the map, under the same index.
#[derive(Debug)]
pub struct RelitWorld {
    /// Game path of the map.
    pub name: String,
    /// The map itself.
    pub bsp: Bsp,
    /// Materials that the surfaces use, each (name, flags, lighting) once.
    pub materials: Vec<WorldMaterial>,
    /// The map's surfaces; those that are not drawn have no indices.
    pub surfaces: Vec<WorldSurface>,
    /// The map's models: 0 is the world.
    pub models: Vec<WorldModel>,
    /// Vertices of all surfaces, model space.
    pub vertices: Vec<WorldVertex>,
    /// Triangles of all surfaces: indices into `vertices`, clockwise seen from the front.
    pub indices: Vec<u32>,
    /// For every triangle of `indices`, the [`TriangleLight`] that it is, or [`NO_LIGHT`].
    pub triangle_lights: Vec<u32>,
    /// Pages of baked light that scripts name, beside those in the map: as they are shown, without overbright bits. Page
    /// numbers count on from the map's own.
    pub pages: Vec<Lightmap>,
    /// Game path of the file of each of `pages`.
    pub files_of_pages: Vec<String>,
    /// Coronas.
    pub flares: Vec<Flare>,
    /// Files of materials, if they were read.
    pub by_hand: MaterialsByHand,
    /// Fog volumes; a surface's `fog` is an index into this plus 1.
    pub fogs: Vec<WorldFog>,
    /// Emitting triangles; those of one surface follow each other.
    pub lights: Vec<TriangleLight>,
    /// Light entities left in the map, then lights placed by calibration.
    pub point_lights: Vec<PointLight>,
    /// Suns.
    pub suns: Vec<SunLight>,
    /// Light lists of the clusters.
    pub light_lists: LightLists,
    /// Ambient radiance: the compiler's, or the fitted one.
    pub ambient: Vec3,
    /// Material of the sky that covers the largest area; `None` for a map without sky.
    pub sky: Option<u32>,
    /// Light sources found, and their evidence.
    pub report: LightReport,
    /// Result of calibration; `None` if the world is not calibrated.
    pub calibration: Option<CalibrationReport>,
    /// Problems that were repaired: missing materials, invalid values. Each appears once.
    pub warnings: Vec<String>,
    /// How colours of stored light and directives are interpreted.
    pub light_color: LightColor,
    /// What ratios of the channels of stored light were raised to, to get the colours of light: see
    /// [`LightColor`].
    pub color_exponent: f32,
    /// Gamma g of the map's compiler, which stored L^(1 / g); 1 if it stored light unchanged or if the world is not
    /// [calibrated](crate::calibrate()). The unit of light is display white for any gamma.
    pub stored_gamma: f32,
    /// Light cutoff: unshadowed irradiance over π that a light must exceed at a surface to light it. Fast compiler
    /// modes leave out contributions below one step of light. 0: no cutoff. Suns and skies have none. Found by
    /// [calibration](crate::calibrate()).
    pub light_cutoff: f32,
    /// Whether the lights are [those of a compiler](Self::take_compiled_lights): the cutoff applies to points alone, and a
    /// single ray to a triangle goes to the middle of its bounds.
    pub has_compiled_lights: bool,
    /// Whether curves cast no shadow of lamps and suns, as with a compiler's lights: q3map2 lets them cast shadows with
    /// `-patchshadows` alone. They reflect light in any case.
    pub shadowless_curves: bool,
    /// Exposure at which the world's light on the map's textures has the mean brightness of the engine's picture:
    /// found by [calibration](crate::calibrate()). `None`: see [`display_exposure`](Self::display_exposure).
    pub exposure: Option<Exposure>,
    /// Shift that was applied to vertex colours; see [`overbright`].
    pub overbright_shift: u32,
}

impl RelitWorld {
    /// A page of baked light as it is stored: of the map's own, then of [`pages`](Self::pages). `None` when there is no
    /// such page.
    pub fn page(&self, page: usize) -> Option<&Lightmap> {
        let own = &self.bsp.lightmaps;
        own.get(page)
            .or_else(|| self.pages.get(page.checked_sub(own.len())?))
    }

    /// Whether a page is shown as it is stored, without overbright bits.
    pub fn is_shown_as_stored(&self, page: usize) -> bool {
        page >= self.bsp.lightmaps.len()
    }

    /// A page of baked light as it is drawn: RGB bytes, [`overbright::shift`]ed where it is one of the map's own, rows from
    /// the top; `None` when there is no such page.
    pub fn lightmap(&self, page: usize) -> Option<Vec<u8>> {
        let shift = match self.is_shown_as_stored(page) {
            true => 0,
            false => self.overbright_shift,
        };
        let texels = self.page(page)?.0.as_chunks::<3>().0.iter();
        Some(
            texels
                .flat_map(|&texel| overbright::shift(texel, shift))
                .collect(),
        )
    }

    /// Whether a surface of the map itself stops the light of lamps and suns, if its material does.
    pub fn casts_shadow(&self, surface: &WorldSurface) -> bool {
        !(self.shadowless_curves && surface.kind == SurfaceKind::Patch)
    }

    /// Whether any surface [casts no shadow](Self::casts_shadow).
    pub fn has_shadowless(&self) -> bool {
        !self
            .surfaces
            .iter()
            .all(|surface| self.casts_shadow(surface))
    }

    /// The material of a surface.
    pub fn material_of(&self, surface: &WorldSurface) -> Option<&WorldMaterial> {
        slice::get(&self.materials, surface.material as usize)
    }

    /// The vertices of a surface.
    pub fn vertices_of(&self, surface: &WorldSurface) -> &[WorldVertex] {
        part(
            &self.vertices,
            span(surface.first_vertex, surface.num_vertices),
        )
    }

    /// The indices of a surface, three a triangle.
    pub fn indices_of(&self, surface: &WorldSurface) -> &[u32] {
        part(
            &self.indices,
            span(surface.first_index, surface.num_indices),
        )
    }

    /// Surface of each triangle of [`indices`](Self::indices); `u32::MAX` for a triangle of none.
    pub fn surfaces_of_triangles(&self) -> Vec<u32> {
        let mut of_triangle = vec![u32::MAX; self.indices.len() / 3];
        for (index, surface) in (0u32..).zip(&self.surfaces) {
            part_mut(&mut of_triangle, surface.triangles()).fill(index);
        }
        of_triangle
    }

    /// Corners of a triangle of [`indices`](Self::indices), model space.
    pub fn triangle(&self, triangle: usize) -> [Vec3; 3] {
        self.corners(triangle).map(|v| v.position)
    }

    /// Vertices of a triangle of [`indices`](Self::indices).
    pub(crate) fn corners(&self, triangle: usize) -> [WorldVertex; 3] {
        let corners: [u32; 3] = item(self.indices.as_chunks().0, triangle);
        corners.map(|i| item(&self.vertices, i as usize))
    }

    /// Change of a light over time; `None` if it is constant.
    pub fn flicker_of(&self, light: &TriangleLight) -> Option<&Flicker> {
        let surface = self.surfaces.get(light.surface as usize)?;
        self.materials
            .get(surface.material as usize)?
            .flicker
            .as_ref()
    }

    /// Exposure for showing the map: from calibration, else from its lightmaps or vertex colours.
    pub fn display_exposure(&self) -> Exposure {
        let stored = || exposure::of_stored_light(&self.bsp, &self.pages, self.stored_gamma);
        self.exposure.unwrap_or_else(stored)
    }

    /// Number of light sources of all kinds.
    pub fn light_count(&self) -> usize {
        self.lights.len() + self.point_lights.len() + self.suns.len()
    }
}
