//! What was found in a map, by which evidence, and how well it agrees with stored light.

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

/// What measurements were taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evidence {
    /// Lightmap texels.
    Lightmaps,
    /// Colours of vertices: the map has no lightmaps.
    Vertices,
    /// Points of the light grid: neither lightmaps nor lit vertices.
    Grid,
    /// Nothing that tells of light.
    #[default]
    Nothing,
}

impl Evidence {
    /// A short name for tables and files.
    pub fn label(self) -> &'static str {
        match self {
            Evidence::Lightmaps => "lightmaps",
            Evidence::Vertices => "vertices",
            Evidence::Grid => "grid",
            Evidence::Nothing => "nothing",
        }
    }

    /// The evidence of a [`label`](Self::label).
    pub(crate) fn from_label(label: &str) -> Option<Evidence> {
        let all = [
            Evidence::Lightmaps,
            Evidence::Vertices,
            Evidence::Grid,
            Evidence::Nothing,
        ];
        all.into_iter().find(|e| e.label() == label)
    }
}

/// Computed light against stored light, over measurements that fitting did not see.
///
/// Stops are those of what is stored: what a map's compiler is known to have done to light before it stored it (a gamma,
/// darker corners) is done to computed light, too.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Agreement {
    /// Median of |log2(computed / stored)|, stops: 0 is perfect, 1 is a factor of two.
    pub median_stops: f32,
    /// Nine in ten are better than this, stops.
    pub worst_tenth_stops: f32,
    /// Sum of computed over sum of stored light.
    pub sum_ratio: f32,
}

/// What calibration did.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationReport {
    /// What told of light.
    pub evidence: Evidence,
    /// Measurements taken.
    pub samples: usize,
    /// Of those, kept out of fitting.
    pub held_out: usize,
    /// Sources that the map's directives tell of; the triangle lights of one material count once.
    pub known: usize,
    /// Lights put in.
    pub placed: usize,
    /// Back splashes put in: weak lights in front of lamps, as the compiler had them.
    pub splashes: usize,
    /// Suns put in.
    pub suns: usize,
    /// Gamma that the compiler encoded light with before it stored it: see
    /// [`RelitWorld::stored_gamma`](crate::RelitWorld::stored_gamma).
    pub gamma: f32,
    /// Whether the map's lights end where they give little: see [`RelitWorld::light_cutoff`](crate::RelitWorld::light_cutoff).
    pub has_cutoff: bool,
    /// Whether the compiler made corners darker (its *dirt*): what it stored is compared with light made as dark.
    pub dirty: bool,
    /// Agreement of the light that directives tell of: direct, ambient and bounced.
    pub before: Agreement,
    /// Agreement of calibrated light: direct, ambient and bounced.
    pub after: Agreement,
    /// Whether the result was kept from an earlier time.
    pub cached: bool,
    /// Time that it took.
    pub seconds: f64,
}

impl Default for CalibrationReport {
    /// Nothing done, of a map that stores light as it is.
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
