//! Materials of a world: each combination of name, flags and lighting that its surfaces use.

use crate::light::{Emission, Flicker};
use crate::materials::Resolved;
use glam::Vec3;
use q3bsp::{Bsp, SurfaceKind, lightmap_index};
use shaderscript::ImplicitKind;
use shaderscript::light::LightClass;

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
    /// What is drawn, what the script says, and what is wrong.
    pub resolved: Resolved,
    /// What it is to light, as it is drawn.
    pub class: LightClass,
    /// Part of incident light that it throws back, diffuse, mean over its texture, linear. Zero unless the world
    /// was loaded to be calibrated.
    pub albedo: Vec3,
    /// Mean radiance of what it shows of its own, linear: of a sky its picture. Bounced rays find it where it is in no
    /// light list. Zero unless the world was loaded to be calibrated.
    pub shown: Vec3,
    /// Light that it emits; `None` for most.
    pub emission: Option<Emission>,
    /// How that light changes in time; `None` for most.
    pub flicker: Option<Flicker>,
}

impl WorldMaterial {
    /// Whether it is sky, for the map or for its script.
    pub fn is_sky(&self) -> bool {
        self.surface_flags & q3bsp::surface_flags::SKY != 0 || self.resolved.shader.sky.is_some()
    }
}

/// The lightmap index that the engine uses for a surface: triangle soups are lit by vertex, and so is what
/// names a page that is not there or a code that does not exist.
pub(super) fn lightmap_of(bsp: &Bsp, index: usize) -> i32 {
    let Some(surface) = bsp.surfaces.get(index) else {
        return lightmap_index::BY_VERTEX;
    };
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

/// The implicit material that belongs to a lightmap index.
pub(super) fn lighting_of(lightmap: i32) -> ImplicitKind {
    match lightmap {
        0.. => ImplicitKind::Lightmapped,
        lightmap_index::NONE => ImplicitKind::EntityLit,
        lightmap_index::WHITE => ImplicitKind::White,
        lightmap_index::TWO_D => ImplicitKind::TwoD,
        _ => ImplicitKind::Vertex,
    }
}
