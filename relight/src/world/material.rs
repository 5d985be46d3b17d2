//! Materials of a world: one for each combination of name, flags and lighting that its surfaces use.

use super::holes::Holes;
use super::pages::{BakedPages, PageLoader};
use crate::emitters::{self, Emission, Flicker, Shade};
use crate::materials::Resolved;
use crate::materials::light::{LightClass, classify};
use glam::Vec3;
use q3bsp::{Bsp, Surface, SurfaceKind, lightmap_index};
use shaderscript::ImplicitKind;
use std::sync::Arc;

/// A material of a world.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldMaterial {
    /// Name as the map writes it.
    pub name: String,
    /// `SURF_*` flags that the map's compiler saw: not always those of the script, nor the same for all
    /// surfaces of one name.
    pub surface_flags: u32,
    /// `CONTENTS_*` flags that the map's compiler saw.
    pub content_flags: u32,
    /// How its surfaces are lit where the material itself leaves it open.
    pub lighting: ImplicitKind,
    /// What is drawn, the script's definition, and faults. Its stages have at most one `$lightmap` stage; further
    /// baked light is in `baked`.
    pub resolved: Resolved,
    /// Where its baked light lies, beside the pages of its surfaces.
    pub baked: BakedPages,
    /// What it is to light, as it is drawn.
    pub class: LightClass,
    /// Part of incident light that it throws back, diffuse, mean over its texture, linear. Zero unless the world
    /// was loaded to be calibrated.
    pub albedo: Vec3,
    /// What it throws back of light all over its texture, from dark to bright, equal parts of it each; without
    /// [`stored_scale`](Self::stored_scale). Empty of skies, and unless the world was loaded to be calibrated.
    pub shades: Vec<Shade>,
    /// Where light passes a cut-out; `None` for other materials, if unknown, and unless the world was loaded to be
    /// calibrated.
    pub holes: Option<Arc<Holes>>,
    /// Mean radiance of what it shows of its own, linear: of a sky its picture. Bounced rays find it where it is in no
    /// light list. Zero unless the world was loaded to be calibrated.
    pub shown: Vec3,
    /// Light that it emits; `None` for most.
    pub emission: Option<Emission>,
    /// How that light changes in time; `None` for most.
    pub flicker: Option<Flicker>,
}

impl WorldMaterial {
    /// A material before its emission and albedo are measured. `flags`: `SURF_*` and `CONTENTS_*`.
    pub(crate) fn new(
        name: &str,
        flags: (u32, u32),
        lighting: ImplicitKind,
        mut resolved: Resolved,
        pages: &mut PageLoader<'_>,
    ) -> WorldMaterial {
        let baked = pages.take(&mut resolved.shader);
        WorldMaterial {
            name: name.to_owned(),
            surface_flags: flags.0,
            content_flags: flags.1,
            lighting: match baked.main {
                Some(_) => ImplicitKind::Lightmapped,
                None => lighting,
            },
            class: classify(&resolved.shader),
            resolved,
            baked,
            albedo: Vec3::ZERO,
            shades: Vec::new(),
            holes: None,
            shown: Vec3::ZERO,
            emission: None,
            flicker: None,
        }
    }

    /// Factor that the compiler applied to light before storing it in lightmaps of this material; the surface shows
    /// its light by this factor.
    ///
    /// The author wanted such surfaces darker or brighter than their light: the factor is part of the
    /// [`albedo`](Self::albedo), not of the light.
    pub fn stored_scale(&self) -> f32 {
        let directive = self.resolved.definition().light.lightmap_brightness;
        let lightmapped = self.lighting == ImplicitKind::Lightmapped;
        emitters::stored_scale(directive.filter(|_| lightmapped))
    }

    /// Whether the map's flags or the script make it sky.
    pub fn is_sky(&self) -> bool {
        self.surface_flags & q3bsp::surface_flags::SKY != 0 || self.resolved.shader.sky.is_some()
    }
}

/// Lightmap index that the engine uses for a surface: triangle soups are lit by vertex, as are surfaces with a page
/// or code that does not exist.
pub(crate) fn lightmap_of(bsp: &Bsp, surface: &Surface) -> i32 {
    let page = usize::try_from(surface.lightmap).ok();
    match surface.kind {
        SurfaceKind::TriangleSoup | SurfaceKind::Flare | SurfaceKind::Foliage => {
            lightmap_index::BY_VERTEX
        }
        _ if page.is_some_and(|page| page >= bsp.lightmaps.len()) => lightmap_index::BY_VERTEX,
        _ if surface.lightmap < lightmap_index::TWO_D => lightmap_index::BY_VERTEX,
        _ => surface.lightmap,
    }
}

/// Implicit material of a lightmap index.
pub(crate) fn lighting_of(lightmap: i32) -> ImplicitKind {
    match lightmap {
        0.. => ImplicitKind::Lightmapped,
        lightmap_index::NONE => ImplicitKind::EntityLit,
        lightmap_index::WHITE => ImplicitKind::White,
        lightmap_index::TWO_D => ImplicitKind::TwoD,
        _ => ImplicitKind::Vertex,
    }
}
