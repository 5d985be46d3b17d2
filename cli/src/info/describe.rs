//! Description of a map.

use std::collections::BTreeMap;

use q3bsp::{Bsp, LumpEntry, SurfaceKind, lightmap_index};
use relight::{CalibrationReport, RelitWorld};
use serde::Serialize;

/// Description of a map, for output as a table or as JSON.
#[derive(Serialize)]
pub struct MapInfo {
    pub map: String,
    pub format: &'static str,
    /// Size of the file, bytes.
    pub bytes: usize,
    pub lumps: Vec<LumpInfo>,
    /// Bounds of the drawn triangles, id units; absent without triangles.
    pub bounds: Option<[[f32; 3]; 2]>,
    pub surfaces: usize,
    /// Number of surfaces of each kind.
    pub surfaces_by_kind: BTreeMap<&'static str, usize>,
    pub triangles: usize,
    pub models: usize,
    pub brushes: usize,
    pub entities: usize,
    /// Number of entities of each class.
    pub entities_by_class: BTreeMap<String, usize>,
    pub materials: usize,
    /// Materials without script and image, or that the engine rejects; drawn as the default image.
    pub missing: Vec<String>,
    pub lightmaps: Lightmaps,
    pub light_grid: Option<LightGrid>,
    pub fogs: Vec<Fog>,
    pub clusters: usize,
    /// Number of clusters visible from a cluster, itself included; absent without visibility data.
    pub clusters_seen: Option<Seen>,
    pub triangle_lights: usize,
    /// Number of triangle lights by source.
    pub lights_by_source: BTreeMap<&'static str, usize>,
    pub point_lights: usize,
    pub suns: usize,
    pub ambient: [f32; 3],
    pub mean_list_length: f64,
    pub longest_list: usize,
    pub degenerate_triangles: usize,
    pub emitters: Vec<Emitter>,
    /// Agreement with the map's lightmaps; absent unless requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    pub warnings: Vec<String>,
    pub milliseconds: u128,
}

/// A lump of the file.
#[derive(Serialize)]
pub struct LumpInfo {
    pub name: &'static str,
    pub offset: i32,
    pub bytes: i32,
    /// Number of records; absent for text, images and compressed data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub records: Option<usize>,
}

/// The lightmaps, and the light sources of surfaces.
#[derive(Serialize)]
pub struct Lightmaps {
    pub pages: usize,
    /// Texels along a side of a page.
    pub size: usize,
    /// The pages are files beside the map.
    pub beside: bool,
    pub surfaces_with_page: usize,
    pub surfaces_by_vertex: usize,
    /// Surfaces with neither: fullbright, or lit like entities.
    pub surfaces_without: usize,
    /// Light styles besides the constant one.
    pub styles: Vec<u8>,
}

/// The light grid.
#[derive(Serialize)]
pub struct LightGrid {
    pub counts: [usize; 3],
    pub spacing: [f32; 3],
    /// Number of points inside walls.
    pub dark: usize,
}

/// A fog volume.
#[derive(Serialize)]
pub struct Fog {
    pub material: String,
    pub mins: [f32; 3],
    pub maxs: [f32; 3],
    pub color: [f32; 3],
    /// Distance at which the fog is opaque, id units.
    pub depth: f32,
}

/// Number of visible clusters.
#[derive(Serialize)]
pub struct Seen {
    pub mean: f64,
    pub least: usize,
    pub median: usize,
    pub most: usize,
}

/// Agreement with the map's lightmaps, at samples held out of the fit.
#[derive(Serialize)]
pub struct Calibration {
    /// Kind of stored light.
    pub evidence: &'static str,
    pub samples: usize,
    pub held_out: usize,
    pub known_sources: usize,
    pub placed_lights: usize,
    pub before: Agreement,
    pub after: Agreement,
    pub cached: bool,
    pub seconds: f64,
}

/// Traced light against stored light.
#[derive(Serialize)]
pub struct Agreement {
    pub median_stops: f32,
    pub worst_tenth_stops: f32,
    pub sum_ratio: f32,
}

impl Calibration {
    fn new(report: &CalibrationReport) -> Calibration {
        let agreement = |a: &relight::calibrate::Agreement| Agreement {
            median_stops: a.median_stops,
            worst_tenth_stops: a.worst_tenth_stops,
            sum_ratio: a.sum_ratio,
        };
        Calibration {
            evidence: report.evidence.label(),
            samples: report.samples,
            held_out: report.held_out,
            known_sources: report.known,
            placed_lights: report.placed,
            before: agreement(&report.before),
            after: agreement(&report.after),
            cached: report.cached,
            seconds: report.seconds,
        }
    }
}

/// One emitting material.
#[derive(Serialize)]
pub struct Emitter {
    pub material: String,
    pub source: &'static str,
    pub radiance: [f32; 3],
    pub surfaces: usize,
    pub triangles: usize,
    pub area: f64,
}

/// Name of a kind of surface.
fn kind_name(kind: SurfaceKind) -> &'static str {
    match kind {
        SurfaceKind::Planar => "planar",
        SurfaceKind::Patch => "patch",
        SurfaceKind::TriangleSoup => "mesh",
        SurfaceKind::Flare => "flare",
        SurfaceKind::Foliage => "foliage",
        SurfaceKind::Other(_) => "other",
    }
}

impl MapInfo {
    /// Describes a loaded map; `bytes`: size of its file.
    pub fn new(
        world: &RelitWorld,
        bytes: usize,
        lumps: &[LumpEntry],
        milliseconds: u128,
    ) -> MapInfo {
        let (bsp, report) = (&world.bsp, &world.report);
        let faulty = world.materials.iter();
        let faulty = faulty.filter(|m| m.resolved.fault.is_some());
        let mut missing: Vec<_> = faulty.map(|m| m.name.clone()).collect();
        missing.sort();
        missing.dedup();
        let mut lights_by_source = BTreeMap::new();
        for emitter in &report.emitters {
            *lights_by_source.entry(emitter.source.label()).or_default() += emitter.triangles;
        }
        let mut surfaces_by_kind = BTreeMap::new();
        for surface in &bsp.surfaces {
            *surfaces_by_kind.entry(kind_name(surface.kind)).or_default() += 1;
        }
        let entities = bsp.entities();
        let mut entities_by_class = BTreeMap::new();
        for entity in &entities {
            let class = entity.classname().to_owned();
            *entities_by_class.entry(class).or_default() += 1;
        }
        let emitters = report.emitters.iter().map(|e| Emitter {
            material: e.name.clone(),
            source: e.source.label(),
            radiance: e.radiance.to_array(),
            surfaces: e.surfaces,
            triangles: e.triangles,
            area: e.area,
        });
        let fogs = world.fogs.iter().map(|fog| Fog {
            material: fog.volume.shader.clone(),
            mins: fog.volume.mins.to_array(),
            maxs: fog.volume.maxs.to_array(),
            color: fog.color.to_array(),
            depth: fog.depth,
        });
        MapInfo {
            map: world.name.clone(),
            format: bsp.format.name(),
            bytes,
            lumps: lumps.iter().map(LumpInfo::new).collect(),
            bounds: bounds(world),
            surfaces: world.surfaces.len(),
            surfaces_by_kind,
            triangles: world.indices.len() / 3,
            models: bsp.models.len(),
            brushes: bsp.brushes.len(),
            entities: entities.len(),
            entities_by_class,
            materials: world.materials.len(),
            missing,
            lightmaps: Lightmaps::new(world),
            light_grid: LightGrid::new(bsp),
            fogs: fogs.collect(),
            clusters: report.clusters,
            clusters_seen: Seen::new(bsp),
            triangle_lights: report.triangle_lights,
            lights_by_source,
            point_lights: report.point_lights,
            suns: report.suns,
            ambient: world.ambient.to_array(),
            mean_list_length: report.mean_list_length,
            longest_list: report.longest_list,
            degenerate_triangles: report.degenerate_triangles,
            emitters: emitters.collect(),
            calibration: world.calibration.as_ref().map(Calibration::new),
            warnings: world.warnings.clone(),
            milliseconds,
        }
    }
}

/// Bounds of the drawn triangles, with brush models at their initial positions.
fn bounds(world: &RelitWorld) -> Option<[[f32; 3]; 2]> {
    let drawn = world.surfaces.iter().filter(|s| s.num_indices > 0);
    let boxes = drawn.map(|s| {
        let origin = world.models.get(s.model as usize).map(|m| m.origin);
        // every surface belongs to a model of the map
        let origin = origin.unwrap_or_default();
        (s.mins + origin, s.maxs + origin)
    });
    let (mins, maxs) = boxes.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))?;
    Some([mins.to_array(), maxs.to_array()])
}

impl LumpInfo {
    fn new(entry: &LumpEntry) -> LumpInfo {
        let bytes = usize::try_from(entry.range.length).unwrap_or(0);
        LumpInfo {
            name: entry.lump.name(),
            offset: entry.range.offset,
            bytes: entry.range.length,
            records: (entry.stride > 1).then(|| bytes / entry.stride),
        }
    }
}

impl Lightmaps {
    fn new(world: &RelitWorld) -> Lightmaps {
        let bsp = &world.bsp;
        let count = |test: &dyn Fn(i32) -> bool| {
            let surfaces = world.surfaces.iter();
            let lit = surfaces.filter(|s| s.num_indices > 0 && test(s.lightmap));
            lit.count()
        };
        let layers = bsp.layers.surfaces.iter();
        let mut styles: Vec<u8> = layers
            .flat_map(|layers| {
                layers
                    .lightmap_styles
                    .into_iter()
                    .chain(layers.vertex_styles)
            })
            .filter(|&style| style != 0 && style != q3bsp::NO_STYLE)
            .collect();
        styles.sort_unstable();
        styles.dedup();
        let by_vertex = |page| page == lightmap_index::BY_VERTEX;
        Lightmaps {
            pages: bsp.lightmaps.len(),
            beside: false,
            size: bsp.lightmap_size(),
            surfaces_with_page: count(&|page| page >= 0),
            surfaces_by_vertex: count(&by_vertex),
            surfaces_without: count(&|page| page < 0 && !by_vertex(page)),
            styles,
        }
    }
}

impl LightGrid {
    fn new(bsp: &Bsp) -> Option<LightGrid> {
        let layout = bsp.light_grid()?;
        let dark = |p: &&q3bsp::GridPoint| p.ambient == [0; 3];
        Some(LightGrid {
            counts: layout.counts,
            spacing: layout.size.to_array(),
            dark: bsp.light_grid.iter().filter(dark).count(),
        })
    }
}

impl Seen {
    fn new(bsp: &Bsp) -> Option<Seen> {
        let visibility = bsp.visibility.as_ref()?;
        let rows = 0..visibility.clusters;
        let mut counts: Vec<usize> = rows.map(|c| visibility.visible_from(c).count()).collect();
        counts.sort_unstable();
        Some(Seen {
            mean: counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64,
            least: *counts.first()?,
            median: *counts.get(counts.len() / 2)?,
            most: *counts.last()?,
        })
    }
}
