//! Emission of a material.

use glam::Vec3;

/// Evidence for an emission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EmissionSource {
    /// `q3map_surfacelight`.
    SurfaceLight,
    /// `q3map_surfacelight` or `q3map_skylight` of a sky.
    Sky,
    /// `q3map_surfacelight` of a sprite that turns to the viewer.
    Sprite,
    /// Its stages show it glowing.
    Glow,
    /// A flare marks a lamp here.
    Flare,
}

impl EmissionSource {
    /// A short name for tables.
    pub fn label(self) -> &'static str {
        match self {
            EmissionSource::SurfaceLight => "surfacelight",
            EmissionSource::Sky => "sky",
            EmissionSource::Sprite => "sprite",
            EmissionSource::Glow => "glow",
            EmissionSource::Flare => "flare",
        }
    }
}

/// Emission of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// Why.
    pub source: EmissionSource,
    /// Radiance, linear, display units. Of [`EmissionSource::Sprite`]: radiant intensity of each surface, into
    /// every direction.
    pub strength: Vec3,
    /// Whether both sides emit, because both are drawn.
    pub two_sided: bool,
    /// Whether it is the back that emits, because only the back is drawn.
    pub reversed: bool,
    /// Whether its quads turn to the viewer.
    pub turns_to_viewer: bool,
}
