//! Fog volumes with their colour and density.

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

/// Depth of a fog that hides nothing, id units.
const CLEAR: f32 = 1.0e9;

/// Fog volumes of a map, and warnings. Colour and depth come from `fogParms` of the fog's material. Without it, a
/// fog brush is black with depth 1, as the engine's zero-initialized parameters; a fog of the whole world, which
/// the engine rejects, hides nothing.
pub(crate) fn fogs(
    bsp: &Bsp,
    files: &dyn GameFiles,
    materials: &Materials,
) -> (Vec<WorldFog>, Vec<String>) {
    let mut warnings = Vec::new();
    let fill = |volume: FogVolume| {
        let material =
            materials.resolve(files, &volume.shader, shaderscript::ImplicitKind::EntityLit);
        let fog = material.shader.fog;
        let depth = match fog {
            Some(fog) => fog.depth.max(1.0),
            None if volume.fills_world() => {
                warnings.push(format!(
                    "left out the fog {} that fills the world; no script gives it fogParms",
                    volume.shader
                ));
                CLEAR
            }
            None => 1.0,
        };
        WorldFog {
            color: fog.map_or(Vec3::ZERO, |f| f.color),
            depth,
            volume,
        }
    };
    let fogs = bsp.fog_volumes().into_iter().map(fill).collect();
    (fogs, warnings)
}
