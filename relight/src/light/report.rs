//! What was found in a map, and by which evidence.

use super::EmissionSource;
use glam::Vec3;

/// Light sources of a map, counted.
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
    /// Whether directives and glowing stages gave no light at all, and weaker evidence was taken: skies and
    /// glows as they look, flares as lamps.
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
