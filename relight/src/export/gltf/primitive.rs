//! Parts of meshes: vertices, their colours, triangles.

use super::buffer::{Buffers, Kind};
use super::nodes::turn;
use crate::export::geometry::Part;
use crate::export::look::{Look, VertexColor};
use crate::export::{Export, Lightmaps};
use crate::overbright;
use glam::Vec3;
use serde_json::{Value, json};

/// A part of a mesh. `light`: for each vertex the light that its colour is multiplied with.
pub fn primitive(
    buffers: &mut Buffers,
    source: &Export<'_>,
    part: &Part,
    light: Option<&[Vec3]>,
    look: &Look,
    material: usize,
) -> Value {
    let scale = source.options.scale;
    let vertices = &part.vertices;
    let positions = || vertices.iter().map(|v| turn(v.position) * scale);
    let position = buffers.add_floats(Kind::Vec3, positions().map(|p| p.to_array()));
    let first = positions().next().unwrap_or(Vec3::ZERO);
    let (least, most) = positions().fold((first, first), |(a, b), p| (a.min(p), b.max(p)));
    buffers.bound(position, &least.to_array(), &most.to_array());
    let side = if look.reversed { -1.0 } else { 1.0 };
    let normals = vertices
        .iter()
        .map(|v| (turn(v.normal) * side).normalize_or(Vec3::Y).to_array());
    // Without TANGENT, readers compute MikkTSpace's tangents from normals and texture coordinates.
    let mut attributes = json!({
        "POSITION": position,
        "NORMAL": buffers.add_floats(Kind::Vec3, normals),
    });
    if let Value::Object(map) = &mut attributes {
        if look.has_pictures() {
            let st = buffers.add_floats(Kind::Vec2, vertices.iter().map(|v| v.st.to_array()));
            map.insert("TEXCOORD_0".into(), json!(st));
        }
        if look.lightmapped && source.options.lightmaps != Lightmaps::Strip {
            let st = vertices.iter().map(|v| v.lightmap.to_array());
            // a second set needs a first
            if !map.contains_key("TEXCOORD_0") {
                let zero = buffers.add_floats(Kind::Vec2, vertices.iter().map(|_| [0.0; 2]));
                map.insert("TEXCOORD_0".into(), json!(zero));
            }
            map.insert(
                "TEXCOORD_1".into(),
                json!(buffers.add_floats(Kind::Vec2, st)),
            );
        }
        if let Some(colors) = colors(source, part, light, look) {
            map.insert(
                "COLOR_0".into(),
                json!(buffers.add(Kind::Color, &colors, vertices.len())),
            );
        }
    }
    let corners = part.indices.as_chunks::<3>().0.iter();
    let ordered = corners.flat_map(|&[a, b, c]| {
        // the map's front is clockwise
        if look.reversed { [a, b, c] } else { [a, c, b] }
    });
    // 65535 restarts a strip
    let short = vertices.len() < 65_535;
    let mut bytes = Vec::with_capacity(part.indices.len() * if short { 2 } else { 4 });
    for index in ordered {
        if short {
            bytes.extend_from_slice(&(index as u16).to_le_bytes());
        } else {
            bytes.extend_from_slice(&index.to_le_bytes());
        }
    }
    let kind = if short { Kind::Short } else { Kind::Long };
    let indices = buffers.add(kind, &bytes, part.indices.len());
    json!({"attributes": attributes, "indices": indices, "material": material})
}

/// Colours of vertices, linear, 16 bits a channel; `None` where the material uses none.
fn colors(
    source: &Export<'_>,
    part: &Part,
    light: Option<&[Vec3]>,
    look: &Look,
) -> Option<Vec<u8>> {
    let keep = source.options.lightmaps != Lightmaps::Strip;
    let rgb = match look.vertex_color {
        Some(VertexColor::Paint) => true,
        Some(VertexColor::Light) => keep,
        None => false,
    };
    if !rgb && look.vertex_alpha.is_none() && light.is_none() {
        return None;
    }
    let table = overbright::byte_table();
    let fraction = |v: f32| (v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
    let mut out = Vec::with_capacity(part.vertices.len() * 8);
    for (i, v) in part.vertices.iter().enumerate() {
        let [r, g, b, a] = v.color;
        let own = if rgb {
            Vec3::from_array([r, g, b].map(|c| table[usize::from(c)]))
        } else {
            Vec3::ONE
        };
        let light = light.map_or(Vec3::ONE, |l| l.get(i).copied().unwrap_or(Vec3::ONE));
        let color = (own * light).to_array().map(fraction);
        let alpha = look
            .vertex_alpha
            .map_or(u16::MAX, |of| u16::from(of.weight(a)) * 257);
        out.extend(color.into_iter().chain([alpha]).flat_map(u16::to_le_bytes));
    }
    Some(out)
}
