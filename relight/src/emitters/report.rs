//! Report of the light sources found, their evidence, and their agreement with stored light.

use super::EmissionSource;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Numbers of light sources of a map.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightReport {
    /// Materials that emit, in the order of the world's materials.
    pub emitters: Vec<EmitterSummary>,
    /// Emitting triangles.
    pub triangle_lights: usize,
    /// Triangles of emitting surfaces that are too thin to emit.
    pub degenerate_triangles: usize,
    /// Light entities.
    pub point_lights: usize,
    /// Suns.
    pub suns: usize,
    /// Mean number of lights in a cluster's list.
    pub mean_list_length: f64,
    /// Longest list of a cluster.
    pub longest_list: usize,
    /// Whether directives and glowing stages gave no light at all, so that weaker evidence is used: sky and glow
    /// images, flares.
    pub fallback: bool,
    /// Visibility clusters.
    pub clusters: usize,
}

/// One emitting material.
#[derive(Debug, Clone, PartialEq)]
pub struct EmitterSummary {
    /// Index into [`RelitWorld::materials`](crate::RelitWorld::materials).
    pub material: u32,
    /// Its name.
    pub name: String,
    /// Why it emits.
    pub source: EmissionSource,
    /// Radiance, linear, display units; of sprites that of the first.
    pub radiance: Vec3,
    /// Surfaces that emit.
    pub surfaces: usize,
    /// Triangles that emit.
    pub triangles: usize,
    /// Their area, square id units.
    pub area: f64,
}

impl LightReport {
    /// Number of triangle lights that come from a kind of evidence.
    pub fn triangles_by(&self, source: EmissionSource) -> usize {
        self.emitters
            .iter()
            .filter(|e| e.source == source)
            .map(|e| e.triangles)
            .sum()
    }
}

/// The stored light that calibration uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Evidence {
    /// Lightmap texels.
    Lightmaps,
    /// Colours of vertices: the map has no lightmaps.
    Vertices,
    /// Points of the light grid: neither lightmaps nor lit vertices.
    Grid,
    /// No stored light.
    #[default]
    Nothing,
}

impl Evidence {
    /// A short name for tables.
    pub fn label(self) -> &'static str {
        match self {
            Evidence::Lightmaps => "lightmaps",
            Evidence::Vertices => "vertices",
            Evidence::Grid => "grid",
            Evidence::Nothing => "nothing",
        }
    }
}

/// Error of computed light against stored light at held-out samples.
///
/// Stops are on the scale of stored light: gamma and dirt of the compiler are applied to computed light as well.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Agreement {
    /// Median of |log2(computed / stored)|, stops: 0 is perfect, 1 is a factor of two.
    pub median_stops: f32,
    /// Nine in ten are better than this, stops.
    pub worst_tenth_stops: f32,
    /// Sum of computed over sum of stored light.
    pub sum_ratio: f32,
}

/// Result of a calibration in numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// Stored light that was used.
    pub evidence: Evidence,
    /// Samples taken.
    pub samples: usize,
    /// Held-out samples among them.
    pub held_out: usize,
    /// Sources with a directive; all triangle lights of a material count once.
    pub known: usize,
    /// Placed point lights.
    pub placed: usize,
    /// Back splashes: weak lights in front of lamps, as the compiler places them.
    pub splashes: usize,
    /// Suns found.
    pub suns: usize,
    /// Gamma with which the compiler encoded light: see
    /// [`RelitWorld::stored_gamma`](crate::RelitWorld::stored_gamma).
    pub gamma: f32,
    /// Whether the map's lights have a cutoff: see [`RelitWorld::light_cutoff`](crate::RelitWorld::light_cutoff).
    pub has_cutoff: bool,
    /// Whether the compiler applied ambient occlusion (*dirt*).
    pub dirty: bool,
    /// Agreement of the directives' light: direct, ambient and reflected.
    pub before: Agreement,
    /// Agreement of the calibrated light: direct, ambient and reflected.
    pub after: Agreement,
    /// Whether the result comes from a cache.
    #[serde(skip)]
    pub cached: bool,
    /// Duration, seconds.
    #[serde(skip)]
    pub seconds: f64,
}

impl Default for CalibrationReport {
    /// No calibration, of a map that stores light unchanged.
    fn default() -> Self {
        CalibrationReport {
            evidence: Evidence::Nothing,
            samples: 0,
            held_out: 0,
            known: 0,
            placed: 0,
            splashes: 0,
            suns: 0,
            gamma: 1.0,
            has_cutoff: false,
            dirty: false,
            before: Agreement::default(),
            after: Agreement::default(),
            cached: false,
            seconds: 0.0,
        }
    }
}
