//! JSON of everything in a relit map, for programs: `docs/src/json.md` and
//! `docs/src/map-json.schema.json` describe it.
//!
//! The document holds the typed map without loss ([`read_map`] gives it back), and what relighting found: materials,
//! lights, and which lights matter where.

use super::extras;
use super::{Export, ExportError, ExportReport, Output};
use crate::emitters::{PointLight, SunLight, TriangleLight};
use crate::materials::finish::Finish;
use crate::world::{RelitWorld, WorldMaterial};
use glam::Vec3;
use q3bsp::Bsp;
use serde::{Deserialize, Serialize};
use serde_json::ser::Formatter;
use serde_json::{Serializer, Value};
use std::io;

/// Name of this kind of document, the value of its key `schema`.
pub const SCHEMA: &str = "relight-map";

/// Version of the document's layout. It grows when a reader of the last would misunderstand it.
pub const VERSION: u32 = 1;

/// What is wrong with a document.
#[derive(Debug, thiserror::Error)]
pub enum JsonError {
    /// Not JSON, or not a map.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// Another kind of document.
    #[error("a document of the schema {0:?}, not {SCHEMA:?}")]
    Schema(String),
    /// Another layout.
    #[error("a document of version {0}, not {VERSION}")]
    Version(u32),
    /// Lightmaps of another size than the format's.
    #[error("a lightmap that has not the {0} bytes of its format")]
    Lightmap(usize),
    /// References that lead out of their lists.
    #[error("not a valid map: {0}")]
    Map(#[from] q3bsp::Error),
}

/// Writes a map.
///
/// # Errors
/// [`ExportError::Write`].
pub(super) fn write(source: &Export<'_>, output: &mut Output) -> Result<ExportReport, ExportError> {
    let finish = |material: &WorldMaterial| source.finish(material);
    let document = document(source.world, &finish).map_err(|problem| ExportError::Write {
        path: output.main().to_owned(),
        source: problem.into(),
    })?;
    output.write_main(&document)?;
    Ok(ExportReport {
        triangles: source.world.indices.len() / 3,
        vertices: source.world.bsp.vertices.len(),
        materials: source.world.materials.len(),
        ..ExportReport::default()
    })
}

#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    version: u32,
    name: &'a str,
    map: &'a Bsp,
    entities: Vec<Vec<(String, String)>>,
    materials: Vec<Value>,
    surface_materials: Vec<u32>,
    lights: Lights<'a>,
    clusters: Vec<Cluster>,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct Lights<'a> {
    triangles: &'a [TriangleLight],
    points: Vec<Point>,
    suns: &'a [SunLight],
    ambient: Vec3,
}

#[derive(Serialize)]
struct Point {
    origin: Vec3,
    intensity: Vec3,
    radius: f32,
    spot_direction: Option<Vec3>,
    spot_tan_half_angle: Option<f32>,
    linear_reach: Option<f32>,
}

impl Point {
    fn of(light: &PointLight) -> Point {
        let spot = light.spot.as_ref();
        Point {
            origin: light.origin,
            intensity: light.intensity,
            radius: light.radius,
            spot_direction: spot.map(|spot| spot.direction),
            spot_tan_half_angle: spot.map(|spot| spot.tan_half_angle),
            linear_reach: light.falloff.reach(),
        }
    }
}

/// The clusters visible from a cluster, and its light list.
#[derive(Serialize)]
struct Cluster {
    sees: Option<Vec<usize>>,
    triangle_lights: Vec<u32>,
    point_lights: Vec<u32>,
    sky: bool,
}

impl Cluster {
    /// A cluster by its number; the number of clusters stands for places outside of all.
    fn of(world: &RelitWorld, cluster: usize) -> Cluster {
        let lists = &world.light_lists;
        let bounds = |at: usize| lists.offsets.get(at).map(|&offset| offset as usize);
        let row = bounds(cluster).zip(bounds(cluster + 1));
        let row = row.and_then(|(start, end)| lists.lights.get(start..end));
        // Point lights follow the triangles.
        let (triangle_lights, points): (Vec<u32>, Vec<u32>) = row
            .unwrap_or_default()
            .iter()
            .partition(|&&light| light < lists.triangle_lights);
        let visibility = world.bsp.visibility.as_ref();
        let visibility = visibility.filter(|_| cluster < lists.clusters());
        Cluster {
            sees: visibility.map(|visibility| visibility.visible_from(cluster).collect()),
            triangle_lights,
            point_lights: points.iter().map(|p| p - lists.triangle_lights).collect(),
            sky: lists.sky.get(cluster).copied().unwrap_or(true),
        }
    }
}

/// JSON without white space, but for a line for each key of the document, of `map` and of `lights`.
#[derive(Default)]
struct Layout {
    /// Arrays and objects around what is written.
    arrays: usize,
    objects: usize,
}

impl Layout {
    fn has_lines(&self) -> bool {
        self.arrays == 0 && self.objects <= 2
    }
}

impl Formatter for Layout {
    fn begin_array<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        self.arrays += 1;
        to.write_all(b"[")
    }

    fn end_array<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        self.arrays -= 1;
        to.write_all(b"]")
    }

    fn begin_object<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        self.objects += 1;
        to.write_all(b"{")
    }

    fn end_object<W: io::Write + ?Sized>(&mut self, to: &mut W) -> io::Result<()> {
        let end: &[u8] = if self.has_lines() { b"\n}" } else { b"}" };
        self.objects -= 1;
        to.write_all(end)
    }

    fn begin_object_key<W: io::Write + ?Sized>(
        &mut self,
        to: &mut W,
        first: bool,
    ) -> io::Result<()> {
        to.write_all(if first { b"" } else { b"," })?;
        to.write_all(if self.has_lines() { b"\n" } else { b"" })
    }

    /// The fewest digits that give the same number, without an exponent.
    fn write_f32<W: io::Write + ?Sized>(&mut self, to: &mut W, value: f32) -> io::Result<()> {
        write!(to, "{value}")
    }
}

/// The document of a map. `finish`: what is stated about the reflection of a material.
///
/// # Errors
/// None but bugs: the document is written to memory.
pub fn document(
    world: &RelitWorld,
    finish: &dyn Fn(&WorldMaterial) -> Finish,
) -> Result<Vec<u8>, serde_json::Error> {
    let entities = world.bsp.entities().into_iter();
    let mut document = Vec::new();
    Document {
        schema: SCHEMA,
        version: VERSION,
        name: &world.name,
        map: &world.bsp,
        entities: entities.map(|entity| entity.pairs).collect(),
        materials: (world.materials.iter())
            .map(|material| extras::material(material, &finish(material)))
            .collect(),
        surface_materials: world.surfaces.iter().map(|s| s.material).collect(),
        lights: Lights {
            triangles: &world.lights,
            points: world.point_lights.iter().map(Point::of).collect(),
            suns: &world.suns,
            ambient: world.ambient,
        },
        clusters: (0..=world.light_lists.clusters())
            .map(|cluster| Cluster::of(world, cluster))
            .collect(),
        warnings: &world.warnings,
    }
    .serialize(&mut Serializer::with_formatter(
        &mut document,
        Layout::default(),
    ))?;
    document.push(b'\n');
    Ok(document)
}

/// Reads the typed map out of a document. Its references are checked as those of a file are.
///
/// # Errors
/// [`JsonError`] for what is not JSON, not such a document, or a map whose references lead out of their lists.
pub fn read_map(document: &[u8]) -> Result<Bsp, JsonError> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
        version: u32,
    }
    #[derive(Deserialize)]
    struct Body {
        map: Bsp,
    }
    let head: Head = serde_json::from_slice(document)?;
    if head.schema != SCHEMA {
        return Err(JsonError::Schema(head.schema));
    }
    if head.version != VERSION {
        return Err(JsonError::Version(head.version));
    }
    let Body { map: mut bsp } = serde_json::from_slice(document)?;
    let page = bsp.format.lightmap_size() * bsp.format.lightmap_size() * 3;
    if bsp.lightmaps.iter().any(|pixels| pixels.0.len() != page) {
        return Err(JsonError::Lightmap(page));
    }
    let repairs = bsp.container.repairs.len();
    bsp.validate()?;
    // What was repaired when the file was read is repaired already.
    bsp.container.repairs.truncate(repairs);
    Ok(bsp)
}

#[cfg(test)]
mod tests;
