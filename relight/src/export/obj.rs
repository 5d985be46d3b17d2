//! Wavefront OBJ and MTL: geometry, normals, texture coordinates, one image a material.

use super::emission;
use super::geometry::{self, Part};
use super::images::Encoded;
use super::layers::{Layer, layers};
use super::look::{Alpha, Look, Slot, affine};
use super::output::Output;
use super::reflection::Reflection;
use super::stack::Moment;
use super::{Export, ExportError, ExportReport};
use crate::world::{WorldMaterial, WorldVertex};
use glam::Vec3;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;
use support::slice;

/// Warning for a material that fades by vertex alpha.
const FADES: &str = "fades by vertex alpha, which OBJ lacks; it does not fade";
/// Warning for a layer weighted by vertex alpha.
const LAYERED: &str = "is weighted by vertex alpha, which OBJ lacks; it is on triangles that it covers by half or more";
/// Warning for a material with a map of roughness.
const MAPPED: &str = "has a map of roughness, metal or reflectance, which OBJ lacks; it is diffuse";

/// Whether a layer covers half of a triangle or more.
fn mostly(layer: &Layer<'_>, corners: [WorldVertex; 3]) -> bool {
    corners.into_iter().map(|v| layer.cover(&v)).sum::<f32>() >= 1.5
}

/// Writes `NAME.obj`, `NAME.mtl` and the images.
pub(super) fn write(source: &Export<'_>, output: &mut Output) -> Result<ExportReport, ExportError> {
    let world = source.world;
    let geometry = geometry::gather(world, &|_, page| page);
    let stem = output.stem();
    let mut report = ExportReport {
        triangles: geometry.triangles(),
        degenerate: geometry.degenerate,
        vertices: geometry.vertices(),
        ..ExportReport::default()
    };
    let mut materials = String::new();
    let mut images: BTreeMap<String, Arc<Encoded>> = BTreeMap::new();
    let mut used: Vec<u32> = geometry.parts().map(|p| p.material).collect();
    used.sort_unstable();
    used.dedup();
    let mut looks = BTreeMap::new();
    let radiances = emission::radiances(world);
    for &index in &used {
        let Some(material) = slice::get(&world.materials, index as usize) else {
            continue;
        };
        let mut made = Vec::new();
        for layer in layers(material) {
            let lowest = layer.stage().is_none();
            let radiance = radiances.get(index as usize).copied();
            let radiance = radiance.filter(|_| lowest);
            let mut look = source.look(&layer, radiance, true, Moment::Mean);
            layer.weigh(source, &mut look);
            if look.reflection.surface.take().is_some() {
                look.reflection.reflectance = None;
                look.lost.push(MAPPED.to_owned());
            }
            if look.vertex_alpha.is_some() && look.alpha != Alpha::Opaque {
                look.lost
                    .push(if lowest { FADES } else { LAYERED }.to_owned());
            }
            let entry = material_entry(source, index, &layer.material, &look, &mut images)?;
            materials.push_str(&entry);
            let name = &layer.material.name;
            let lost = look.lost.iter();
            report
                .warnings
                .extend(lost.map(|l| format!("material {name}: {l}")));
            made.push((layer, look));
            report.materials += 1;
        }
        looks.insert(index, made);
    }
    report.images = images.len();

    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "# {}: y up, {} of an id unit",
        world.name, source.options.scale
    );
    let _ = writeln!(text, "mtllib {stem}.mtl");
    let mut first = 1;
    for (number, mesh) in geometry.models.iter().enumerate() {
        if mesh.parts.is_empty() {
            continue;
        }
        let origin = world.models.get(number).map_or(Vec3::ZERO, |m| m.origin);
        let _ = writeln!(
            text,
            "o {}",
            if number == 0 {
                "world".to_owned()
            } else {
                format!("model_{number}")
            }
        );
        for part in &mesh.parts {
            let made = looks.get(&part.material).into_iter().flatten();
            for (height, (layer, look)) in made.enumerate() {
                let mut part = Cow::Borrowed(part);
                if height > 0 {
                    let (upper, _) = layer.raise(&part, height, look, &|c| mostly(layer, c));
                    if upper.indices.is_empty() {
                        continue;
                    }
                    report.triangles += upper.indices.len() / 3;
                    report.vertices += upper.vertices.len();
                    part = Cow::Owned(upper);
                }
                let name = material_name(part.material, &layer.material.name);
                let _ = writeln!(text, "usemtl {name}");
                write_part(&mut text, &part, look, origin, source.options.scale, first);
                first += part.vertices.len();
            }
        }
    }
    for image in images.values() {
        output.write_beside(&format!("images/{}", image.path), &image.bytes)?;
    }
    output.write_beside(&format!("{stem}.mtl"), materials.as_bytes())?;
    output.write_main(text.as_bytes())?;
    Ok(report)
}

/// Names of materials must not repeat, and end at the first space.
fn material_name(index: u32, name: &str) -> String {
    let name: String = name
        .chars()
        .map(|c| {
            if c.is_whitespace() || c.is_control() {
                '_'
            } else {
                c
            }
        })
        .collect();
    format!("{name}.{index}")
}

fn write_part(text: &mut String, part: &Part, look: &Look, origin: Vec3, scale: f32, first: usize) {
    let color = look.color.as_ref();
    let tc_mods = color.map_or(&[][..], |slot| &slot.tc_mods);
    let ([s, t], translate) = affine(tc_mods, 0.0);
    let turn = |v: Vec3| Vec3::new(v.x, v.z, -v.y);
    for v in &part.vertices {
        let p = turn(v.position + origin) * scale;
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for v in &part.vertices {
        // Rows of images count from below.
        let st = s * v.st.x + t * v.st.y + translate;
        let _ = writeln!(text, "vt {} {}", st.x, 1.0 - st.y);
    }
    for v in &part.vertices {
        let n = turn(v.normal);
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    for &[a, b, c] in part.indices.as_chunks::<3>().0 {
        let [a, b, c] =
            if look.reversed { [a, b, c] } else { [c, b, a] }.map(|i| first + i as usize);
        let _ = writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}");
    }
}

fn material_entry(
    source: &Export<'_>,
    index: u32,
    material: &WorldMaterial,
    look: &Look,
    images: &mut BTreeMap<String, Arc<Encoded>>,
) -> Result<String, ExportError> {
    let mut text = String::new();
    let mut map = |keyword: &str, slot: &Option<Slot>| -> Result<String, ExportError> {
        let Some(slot) = slot else {
            return Ok(String::new());
        };
        let found = source.picture(&slot.picture, &material.resolved.shader)?;
        let Some(image) = found else {
            return Ok(String::new());
        };
        let clamp = if slot.clamp { "-clamp on " } else { "" };
        let line = format!("{keyword} {clamp}images/{}\n", image.path);
        images.insert(image.path.clone(), image);
        Ok(line)
    };
    let [x, y, z, w] = look.factor.to_array();
    let _ = writeln!(text, "newmtl {}", material_name(index, &material.name));
    // Old programs show no glow: what only glows is given its colour.
    let glows = Vec3::new(x, y, z).max_element() < 1.0e-3;
    let [r, g, b] = if glows {
        look.glow_factor.to_array()
    } else {
        [x, y, z]
    };
    let _ = writeln!(text, "Kd {r} {g} {b}");
    let reflection = &look.reflection;
    match reflection.reflectance.filter(|_| look.dielectric.is_none()) {
        Some(Vec3 { x, y, z }) => {
            let Reflection {
                roughness, metal, ..
            } = reflection;
            let _ = writeln!(text, "Ks {x} {y} {z}\nPr {roughness}\nPm {metal}\nillum 2");
        }
        None => text.push_str("Ks 0 0 0\nillum 1\n"),
    }
    let e = look.glow_factor;
    if e != Vec3::ZERO {
        let _ = writeln!(text, "Ke {} {} {}", e.x, e.y, e.z);
    }
    let opacity = match look.dielectric {
        Some(dielectric) => 1.0 - dielectric.transmission,
        None => w,
    };
    if opacity < 1.0 {
        let _ = writeln!(text, "d {opacity}");
    }
    if let Some(dielectric) = look.dielectric {
        let _ = writeln!(text, "Ni {}", dielectric.index);
    }
    text.push_str(&map("map_Kd", &look.color)?);
    if look.alpha != Alpha::Opaque {
        text.push_str(&map("map_d", &look.color)?);
    }
    text.push_str(&map("map_Ke", &look.glow)?);
    text.push_str(&map("norm", &reflection.normals)?);
    text.push('\n');
    Ok(text)
}
