//! JSON of everything in a relit map, for programs: `docs/map-json.md` and `docs/map-json.schema.json` describe it.
//!
//! The document holds the typed map without loss ([`read_map`] gives it back), and what relighting found: materials,
//! lights, and which lights matter where.

mod model;
mod values;

pub use values::JsonError;

use super::extras;
use super::{Export, ExportError, ExportReport, Output};
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Bsp;
use serde_json::Value;
use values::{Json, WriteText, field, put_display, put_list};

/// Name of this kind of document, the value of its key `schema`.
pub const SCHEMA: &str = "relight-map";

/// Version of the document's layout. It grows when a reader of the last would misunderstand it.
pub const VERSION: u32 = 1;

/// Writes a map.
///
/// # Errors
/// [`ExportError::Write`].
pub(super) fn write(source: &Export<'_>, output: &mut Output) -> Result<ExportReport, ExportError> {
    output.write_main(document(source.world).as_bytes())?;
    Ok(ExportReport {
        triangles: source.world.indices.len() / 3,
        vertices: source.world.bsp.vertices.len(),
        materials: source.world.materials.len(),
        ..ExportReport::default()
    })
}

/// The document of a map.
pub fn document(world: &RelitWorld) -> String {
    let mut out = String::from("{\n\"schema\":");
    SCHEMA.write(&mut out);
    out.push_str(",\n\"version\":");
    VERSION.put(&mut out);
    out.push_str(",\n\"name\":");
    world.name.put(&mut out);
    out.push_str(",\n\"map\":");
    model::put_map(&world.bsp, &mut out);
    out.push_str(",\n\"entities\":");
    put_list(&mut out, world.bsp.entities(), |entity, out| {
        put_list(out, &entity.pairs, |(key, value), out| {
            put_list(out, [key, value], |text, out| text.put(out));
        });
    });
    out.push_str(",\n\"materials\":");
    put_list(&mut out, &world.materials, |material, out| {
        put_display(out, extras::material(material));
    });
    out.push_str(",\n\"surface_materials\":");
    put_list(&mut out, &world.surfaces, |s, out| s.material.put(out));
    out.push_str(",\n\"lights\":");
    put_lights(world, &mut out);
    out.push_str(",\n\"clusters\":");
    put_clusters(world, &mut out);
    out.push_str(",\n\"warnings\":");
    put_list(&mut out, &world.warnings, |warning, out| warning.put(out));
    out.push_str("\n}\n");
    out
}

/// A key, and what writes its value.
type Part<'a> = (&'a str, &'a dyn Fn(&mut String));

/// Appends an object.
fn put_object(out: &mut String, parts: &[Part<'_>]) {
    out.push('{');
    for (at, (key, put)) in parts.iter().enumerate() {
        if at > 0 {
            out.push(',');
        }
        key.write(out);
        out.push(':');
        put(out);
    }
    out.push('}');
}

fn put_lights(world: &RelitWorld, out: &mut String) {
    out.push_str("{\n\"triangles\":");
    put_list(out, &world.lights, |light, out| {
        let triangle = (light.triangle != u32::MAX).then_some(light.triangle);
        put_object(
            out,
            &[
                ("vertices", &|out| light.vertices.put(out)),
                ("radiance", &|out| light.radiance.put(out)),
                ("two_sided", &|out| light.two_sided.put(out)),
                ("surface", &|out| light.surface.put(out)),
                ("triangle", &|out| triangle.put(out)),
                ("model", &|out| light.model.put(out)),
                ("is_sky", &|out| light.is_sky.put(out)),
                ("source", &|out| light.source.label().write(out)),
            ],
        );
    });
    out.push_str(",\n\"points\":");
    put_list(out, &world.point_lights, |light, out| {
        let direction = light.spot.as_ref().map(|spot| spot.direction);
        let tangent = light.spot.as_ref().map(|spot| spot.tan_half_angle);
        let reach = light.falloff.reach();
        put_object(
            out,
            &[
                ("origin", &|out| light.origin.put(out)),
                ("intensity", &|out| light.intensity.put(out)),
                ("radius", &|out| light.radius.put(out)),
                ("spot_direction", &|out| direction.put(out)),
                ("spot_tan_half_angle", &|out| tangent.put(out)),
                ("linear_reach", &|out| reach.put(out)),
            ],
        );
    });
    out.push_str(",\n\"suns\":");
    put_list(out, &world.suns, |sun, out| {
        put_object(
            out,
            &[
                ("direction", &|out| sun.direction.put(out)),
                ("irradiance", &|out| sun.irradiance.put(out)),
                ("angular_radius", &|out| sun.angular_radius.put(out)),
                ("material", &|out| sun.material.put(out)),
            ],
        );
    });
    out.push_str(",\n\"ambient\":");
    <Vec3 as Json>::put(&world.ambient, out);
    out.push_str("\n}");
}

/// What each cluster sees, and the lights that matter in it; the last row is for places outside of all clusters.
fn put_clusters(world: &RelitWorld, out: &mut String) {
    let lists = &world.light_lists;
    let count = lists.clusters();
    put_list(out, 0..=count, |cluster, out| {
        let bounds = |at: usize| lists.offsets.get(at).map(|&offset| offset as usize);
        let row = bounds(cluster).zip(bounds(cluster + 1));
        let row = row.and_then(|(start, end)| lists.lights.get(start..end));
        // Point lights follow the triangles.
        let (triangles, points): (Vec<u32>, Vec<u32>) = row
            .unwrap_or_default()
            .iter()
            .partition(|&&light| light < lists.triangle_lights);
        let points: Vec<u32> = points.iter().map(|p| p - lists.triangle_lights).collect();
        let sees: Option<Vec<usize>> = match &world.bsp.visibility {
            Some(visibility) if cluster < count => Some(visibility.visible_from(cluster).collect()),
            _ => None,
        };
        let sky = lists.sky.get(cluster).copied().unwrap_or(true);
        put_object(
            out,
            &[
                ("sees", &|out| sees.put(out)),
                ("triangle_lights", &|out| triangles.put(out)),
                ("point_lights", &|out| points.put(out)),
                ("sky", &|out| sky.put(out)),
            ],
        );
    });
}

/// Reads the typed map out of a document. Its references are checked as those of a file are.
///
/// # Errors
/// [`JsonError`] for what is not JSON, not such a document, or a map whose references lead out of their lists.
pub fn read_map(text: &str) -> Result<Bsp, JsonError> {
    let document: Value = serde_json::from_str(text)
        .map_err(|problem| JsonError::new(format!("JSON ({problem})")))?;
    if document.get("schema").and_then(Value::as_str) != Some(SCHEMA) {
        return Err(JsonError::new(format!(
            "a document of the schema {SCHEMA:?}"
        )));
    }
    if field::<u32>(&document, "version")? != VERSION {
        return Err(JsonError::new(format!("version {VERSION}")));
    }
    let missing = || JsonError::new("the key \"map\"");
    let map = document.get("map").ok_or_else(missing)?;
    let mut bsp = model::get_map(map).map_err(|problem| problem.inside("map"))?;
    let page = bsp.format.lightmap_size() * bsp.format.lightmap_size() * 3;
    if bsp
        .lightmaps
        .iter()
        .any(|lightmap| lightmap.0.len() != page)
    {
        return Err(JsonError::new(format!("lightmaps of {page} bytes")));
    }
    let repairs = bsp.container.repairs.len();
    bsp.validate()
        .map_err(|problem| JsonError::new(format!("a valid map ({problem})")))?;
    // What was repaired when the file was read is repaired already.
    bsp.container.repairs.truncate(repairs);
    Ok(bsp)
}

#[cfg(test)]
mod tests;
