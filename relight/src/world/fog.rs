//! Fog volumes with what fills them.

use crate::files::GameFiles;
use crate::materials::Materials;
use glam::Vec3;
use q3bsp::{Bsp, FogVolume};

/// A fog volume.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldFog {
    /// Where it is.
    pub volume: FogVolume,
    /// Colour as the script writes it, nominally 0..1, display space. Black without `fogParms`.
    pub color: Vec3,
    /// Distance inside at which it hides everything, id units; at least 1.
    pub depth: f32,
}

/// The fogs of a map. Colour and depth come from `fogParms` of the fog's material; a material without them
/// gives black fog of depth 1, as the engine's zeroed parameters do.
pub(super) fn fogs(bsp: &Bsp, files: &dyn GameFiles, materials: &Materials) -> Vec<WorldFog> {
    let fill = |volume: FogVolume| {
        let material =
            materials.resolve(files, &volume.shader, shaderscript::ImplicitKind::EntityLit);
        let fog = material.shader.fog;
        WorldFog {
            color: fog.map_or(Vec3::ZERO, |f| f.color),
            depth: fog.map_or(1.0, |f| f.depth).max(1.0),
            volume,
        }
    };
    bsp.fog_volumes().into_iter().map(fill).collect()
}
