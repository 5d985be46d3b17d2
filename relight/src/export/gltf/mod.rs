//! glTF 2.0, binary and text.
//!
//! Light is in the units of [`crate::light`]: a radiance of 1 is display white. glTF's photometric units are taken to be
//! these: what is white here shines with one candela per square metre there, and lights keep their proportions to it.

mod animation;
mod buffer;
mod materials;
mod nodes;

use super::geometry::{self, Geometry, Part};
use super::images::Encoded;
use super::lightmaps::Atlas;
use super::look::{Look, VertexColor};
use super::output::Output;
use super::{Export, ExportError, ExportReport, ImagePlace, Lightmaps, emission, sky};
use crate::overbright;
use crate::world::WorldMaterial;
use buffer::{Buffers, Kind};
use glam::{Vec2, Vec3, Vec4};
use materials::{Maker, Sampling, Textures};
use nodes::{Nodes, turn};
use serde_json::{Map, Value, json};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Which of the two kinds of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    /// One file with everything in it.
    Binary,
    /// JSON, with a file of data beside it.
    Text,
}

/// A document in the making.
struct Document<'a> {
    source: &'a Export<'a>,
    buffers: Buffers,
    textures: Textures,
    extensions: BTreeSet<&'static str>,
    motions: Vec<animation::Motion>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Nodes,
    lightmap: Option<usize>,
    warnings: Vec<String>,
}

/// Writes `NAME.glb`, or `NAME.gltf` with `NAME.bin`, and images where they are not inside.
pub(super) fn write(
    source: &Export<'_>,
    container: Container,
    output: &mut Output,
) -> Result<ExportReport, ExportError> {
    let world = source.world;
    let keep = source.options.lightmaps == Lightmaps::Keep;
    let atlas = keep.then(|| Atlas::new(world)).flatten();
    let geometry = geometry::gather(world, &|surface, page| {
        atlas
            .as_ref()
            .map_or(Vec2::ZERO, |a| a.place(surface, page))
    });
    let mut document = Document {
        source,
        buffers: Buffers::default(),
        textures: Textures::default(),
        extensions: BTreeSet::new(),
        motions: Vec::new(),
        materials: Vec::new(),
        meshes: Vec::new(),
        nodes: Nodes::default(),
        lightmap: None,
        warnings: Vec::new(),
    };
    if let Some(atlas) = &atlas {
        let image = Arc::new(atlas.encode(world, &format!("{}_lightmaps", output.stem()))?);
        document.lightmap = Some(document.textures.add(&image, Sampling::Lightmap));
    }
    let meshes = document.add_meshes(&geometry)?;
    let mut top = document.nodes.add_entities(source, &meshes);
    top.extend(document.nodes.add_fogs(source));
    top.extend(document.add_sky(&geometry)?);
    if source.options.lights {
        top.extend(document.nodes.add_lights(source));
    }
    let report = ExportReport {
        files: Vec::new(),
        triangles: geometry.triangles(),
        degenerate: geometry.degenerate,
        vertices: geometry.vertices(),
        materials: document.materials.len(),
        images: document.textures.images.len(),
        warnings: std::mem::take(&mut document.warnings),
    };
    document.finish(container, top, output)?;
    Ok(report)
}

impl Document<'_> {
    /// Adds the meshes of all models with the materials that they need; for every model its mesh.
    fn add_meshes(&mut self, geometry: &Geometry) -> Result<Vec<Option<usize>>, ExportError> {
        let world = self.source.world;
        let radiances = emission::radiances(world);
        let mut numbers: BTreeMap<u32, (usize, Look)> = BTreeMap::new();
        let mut out = Vec::with_capacity(geometry.models.len());
        for (model, mesh) in geometry.models.iter().enumerate() {
            let mut primitives = Vec::with_capacity(mesh.parts.len());
            for part in &mesh.parts {
                let Some(material) = world.materials.get(part.material as usize) else {
                    continue;
                };
                let (number, look) = match numbers.entry(part.material) {
                    Entry::Occupied(known) => known.into_mut(),
                    Entry::Vacant(place) => {
                        let radiance = radiances.get(part.material as usize).copied();
                        let look = self.source.look(material, radiance);
                        let number = self.add_material(material, &look)?;
                        let lost = look.lost.iter();
                        self.warnings
                            .extend(lost.map(|l| format!("material {}: {l}", material.name)));
                        place.insert((number, look))
                    }
                };
                primitives.push(primitive(
                    &mut self.buffers,
                    self.source,
                    part,
                    look,
                    *number,
                ));
            }
            if primitives.is_empty() {
                out.push(None);
                continue;
            }
            let name = if model == 0 {
                "world".to_owned()
            } else {
                format!("model.{model}")
            };
            self.meshes
                .push(json!({"name": name, "primitives": primitives}));
            out.push(Some(self.meshes.len() - 1));
        }
        Ok(out)
    }

    fn add_material(
        &mut self,
        material: &WorldMaterial,
        look: &Look,
    ) -> Result<usize, ExportError> {
        let number = self.materials.len();
        let made = self.maker().material(number, material, look)?;
        self.materials.push(made);
        Ok(number)
    }

    fn maker(&mut self) -> Maker<'_> {
        Maker {
            source: self.source,
            textures: &mut self.textures,
            extensions: &mut self.extensions,
            lightmap: self.lightmap,
            motions: &mut self.motions,
        }
    }

    /// Adds the sky as a box around everything; `None` for a map without.
    fn add_sky(&mut self, geometry: &Geometry) -> Result<Option<usize>, ExportError> {
        let source = self.source;
        let world = source.world;
        let material = world.sky.and_then(|m| world.materials.get(m as usize));
        let Some(material) = material else {
            return Ok(None);
        };
        let places = geometry
            .parts()
            .chain(&geometry.sky)
            .flat_map(|p| &p.vertices)
            .map(|v| v.position);
        let mut bounds: Option<(Vec3, Vec3)> = None;
        for p in places {
            let (least, most) = bounds.unwrap_or((p, p));
            bounds = Some((least.min(p), most.max(p)));
        }
        let Some((least, most)) = bounds else {
            return Ok(None);
        };
        let middle = (least + most) * 0.5;
        let radius = (most - least).length() * 0.5;
        let mut pictures = Vec::new();
        let mut mean = Vec4::ZERO;
        for side in 0..6 {
            let picture = sky::picture(source.files, material, side);
            let shader = sky::definition(material);
            let image = match &picture {
                Some(picture) => source.images.get(source.files, picture, shader)?,
                None => None,
            };
            if let Some(image) = &image {
                mean += image.mean.extend(1.0);
            }
            pictures.push(image);
        }
        let radiance = world
            .sky
            .and_then(|m| emission::radiances(world).get(m as usize).copied())
            .filter(|r| r.max_element() > 0.0);
        let shown = (mean.w > 0.0).then(|| mean.truncate() / mean.w);
        let strength = match (radiance, shown) {
            (Some(radiance), Some(shown)) if source.options.sky_light => {
                emission::luminance(radiance) / emission::luminance(shown).max(1.0e-3)
            }
            _ => 1.0,
        };
        let mut primitives = Vec::new();
        let mut plain = None;
        for (side, image) in pictures.iter().enumerate() {
            let number = match image {
                Some(image) => self.sky_material(&material.name, side, image, strength),
                None => *plain.get_or_insert_with(|| {
                    let color = radiance.filter(|_| shown.is_none()).unwrap_or(Vec3::ZERO);
                    self.plain_sky(&material.name, color)
                }),
            };
            let corners = [(-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)];
            let scale = source.options.scale;
            let positions =
                corners.map(|(s, t)| turn(middle + sky::point(side, s, t) * radius) * scale);
            let normal = turn(-sky::point(side, 0.0, 0.0));
            primitives.push(quad(&mut self.buffers, positions, normal, number));
        }
        self.meshes
            .push(json!({"name": "sky", "primitives": primitives}));
        let mesh = self.meshes.len() - 1;
        let told = super::extras::material(material);
        Ok(Some(self.nodes.add(json!({
            "name": "sky",
            "mesh": mesh,
            "extras": {"material": told, "radiance": radiance.map(|r| r.to_array())},
        }))))
    }

    fn sky_material(
        &mut self,
        name: &str,
        side: usize,
        image: &Arc<Encoded>,
        strength: f32,
    ) -> usize {
        let texture = self.textures.add(image, Sampling::Clamp);
        let mut material = json!({
            "name": format!("{name} side {side}"),
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
            },
            "emissiveTexture": {"index": texture},
            "emissiveFactor": Vec3::splat(strength.min(1.0)).to_array(),
        });
        if strength > 1.0
            && let Value::Object(map) = &mut material
        {
            self.extensions.insert("KHR_materials_emissive_strength");
            map.insert(
                "extensions".into(),
                json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}}),
            );
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    fn plain_sky(&mut self, name: &str, color: Vec3) -> usize {
        let brightest = color.max_element().max(1.0);
        let mut material = json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
            },
            "emissiveFactor": (color / brightest).to_array(),
        });
        if brightest > 1.0
            && let Value::Object(map) = &mut material
        {
            self.extensions.insert("KHR_materials_emissive_strength");
            map.insert(
                "extensions".into(),
                json!({"KHR_materials_emissive_strength": {"emissiveStrength": brightest}}),
            );
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Puts everything together and writes it.
    fn finish(
        mut self,
        container: Container,
        top: Vec<usize>,
        output: &mut Output,
    ) -> Result<(), ExportError> {
        let source = self.source;
        let world = source.world;
        let mut root = Map::new();
        let stem = output.stem();
        let animations: Vec<Value> = std::mem::take(&mut self.motions)
            .iter()
            .enumerate()
            .map(|(number, motion)| {
                motion.animation(&mut self.buffers, &format!("texture_{number}"))
            })
            .collect();
        if !animations.is_empty() {
            self.extensions.insert("KHR_animation_pointer");
            root.insert("animations".into(), json!(animations));
        }
        if !self.nodes.lights.is_empty() {
            self.extensions.insert("KHR_lights_punctual");
            root.insert(
                "extensions".into(),
                json!({"KHR_lights_punctual": {"lights": self.nodes.lights}}),
            );
        }
        let (bytes, mut views, accessors) = std::mem::take(&mut self.buffers).finish();
        let mut bytes = bytes;
        let inside = match source.options.images {
            ImagePlace::Usual => container == Container::Binary,
            ImagePlace::Embed => true,
            ImagePlace::Beside => false,
        };
        let mut images = Vec::with_capacity(self.textures.images.len());
        for image in &self.textures.images {
            let mut entry = json!({"name": image.path});
            let Value::Object(map) = &mut entry else {
                continue;
            };
            if inside {
                bytes.resize(bytes.len().next_multiple_of(4), 0);
                views.push(json!({
                    "buffer": 0,
                    "byteOffset": bytes.len(),
                    "byteLength": image.bytes.len(),
                }));
                bytes.extend_from_slice(&image.bytes);
                map.insert("bufferView".into(), json!(views.len() - 1));
                map.insert("mimeType".into(), json!(image.mime.text()));
            } else {
                let path = format!("images/{}", image.path);
                output.write_beside(&path, &image.bytes)?;
                map.insert("uri".into(), json!(escaped(&path)));
            }
            images.push(entry);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let (textures, samplers) = self.textures.finish();
        let flares: Vec<Value> = world
            .flares
            .iter()
            .map(|f| {
                json!({
                    "origin": f.origin.to_array(),
                    "color": f.color.to_array(),
                    "normal": f.normal.to_array(),
                    "material": world.materials.get(f.material as usize).map(|m| &m.name),
                })
            })
            .collect();
        let mut told = json!({
            "map": world.name,
            "scale": source.options.scale,
            "axes": "id units (x, y, z) are scale * (x, z, -y)",
            "exposure": crate::exposure::display_exposure(world),
            "ambient": world.ambient.to_array(),
        });
        if let (Value::Object(map), false) = (&mut told, flares.is_empty()) {
            map.insert("flares".into(), json!(flares));
        }
        root.insert(
            "asset".into(),
            json!({
                "version": "2.0",
                "generator": concat!("relight ", env!("CARGO_PKG_VERSION")),
                "extras": told,
            }),
        );
        let all = self.nodes.add(json!({"name": stem, "children": top}));
        root.insert("scene".into(), json!(0));
        root.insert("scenes".into(), json!([{"name": stem, "nodes": [all]}]));
        let lists = [
            ("nodes", self.nodes.nodes),
            ("cameras", self.nodes.cameras),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("textures", textures),
            ("samplers", samplers),
            ("images", images),
            ("accessors", accessors),
            ("bufferViews", views),
        ];
        for (name, list) in lists {
            // glTF forbids empty lists
            if !list.is_empty() {
                root.insert(name.into(), Value::Array(list));
            }
        }
        if !self.extensions.is_empty() {
            root.insert("extensionsUsed".into(), json!(self.extensions));
        }
        match container {
            Container::Binary => {
                if !bytes.is_empty() {
                    root.insert("buffers".into(), json!([{"byteLength": bytes.len()}]));
                }
                let text = Value::Object(root).to_string();
                output.write_main(&binary(text.into_bytes(), &bytes)?)
            }
            Container::Text => {
                if !bytes.is_empty() {
                    let name = format!("{stem}.bin");
                    output.write_beside(&name, &bytes)?;
                    root.insert(
                        "buffers".into(),
                        json!([{"byteLength": bytes.len(), "uri": escaped(&name)}]),
                    );
                }
                output.write_main(Value::Object(root).to_string().as_bytes())
            }
        }
    }
}

/// The binary container: a header, the JSON, the data.
fn binary(mut json: Vec<u8>, data: &[u8]) -> Result<Vec<u8>, ExportError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let data_chunk = if data.is_empty() { 0 } else { 8 + data.len() };
    let total = 12 + 8 + json.len() + data_chunk;
    let small = |size: usize| {
        u32::try_from(size).map_err(|_| ExportError::TooLarge {
            what: "number of bytes of the file",
            found: size as u64,
            limit: u64::from(u32::MAX),
        })
    };
    let mut out = Vec::with_capacity(total);
    out.extend_from_slice(b"glTF");
    out.extend_from_slice(&2u32.to_le_bytes());
    out.extend_from_slice(&small(total)?.to_le_bytes());
    out.extend_from_slice(&small(json.len())?.to_le_bytes());
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&json);
    if !data.is_empty() {
        out.extend_from_slice(&small(data.len())?.to_le_bytes());
        out.extend_from_slice(b"BIN\0");
        out.extend_from_slice(data);
    }
    Ok(out)
}

/// A relative path as a URI.
fn escaped(path: &str) -> String {
    let mut out = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                out.push(char::from(byte));
            }
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}

/// A part of a mesh.
fn primitive(
    buffers: &mut Buffers,
    source: &Export<'_>,
    part: &Part,
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
    let mut attributes = json!({
        "POSITION": position,
        "NORMAL": buffers.add_floats(Kind::Vec3, normals),
    });
    if let Value::Object(map) = &mut attributes {
        if look.color.is_some() || look.glow.is_some() {
            let st = buffers.add_floats(Kind::Vec2, vertices.iter().map(|v| v.st.to_array()));
            map.insert("TEXCOORD_0".into(), json!(st));
        }
        if look.lightmapped && source.options.lightmaps == Lightmaps::Keep {
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
        if let Some(colors) = colors(source, part, look) {
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
fn colors(source: &Export<'_>, part: &Part, look: &Look) -> Option<Vec<u8>> {
    let keep = source.options.lightmaps == Lightmaps::Keep;
    let rgb = match look.vertex_color {
        Some(VertexColor::Paint) => true,
        Some(VertexColor::Light) => keep,
        None => false,
    };
    if !rgb && !look.vertex_alpha {
        return None;
    }
    let table = overbright::byte_table();
    let fraction = |v: f32| (v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
    let mut out = Vec::with_capacity(part.vertices.len() * 8);
    for v in &part.vertices {
        let [r, g, b, a] = v.color;
        let color = if rgb {
            [r, g, b].map(|c| fraction(table[usize::from(c)]))
        } else {
            [u16::MAX; 3]
        };
        let alpha = if look.vertex_alpha {
            u16::from(a) * 257
        } else {
            u16::MAX
        };
        out.extend(color.into_iter().chain([alpha]).flat_map(u16::to_le_bytes));
    }
    Some(out)
}

/// A side of the sky: corners from above left, counter-clockwise.
fn quad(buffers: &mut Buffers, positions: [Vec3; 4], normal: Vec3, material: usize) -> Value {
    let position = buffers.add_floats(Kind::Vec3, positions.iter().map(|p| p.to_array()));
    let (least, most) = positions
        .iter()
        .fold((positions[0], positions[0]), |(a, b), p| {
            (a.min(*p), b.max(*p))
        });
    buffers.bound(position, &least.to_array(), &most.to_array());
    let normals = buffers.add_floats(Kind::Vec3, positions.iter().map(|_| normal.to_array()));
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let st = buffers.add_floats(Kind::Vec2, corners.into_iter());
    let indices: Vec<u8> = [0u16, 1, 2, 0, 2, 3]
        .into_iter()
        .flat_map(u16::to_le_bytes)
        .collect();
    let indices = buffers.add(Kind::Short, &indices, 6);
    json!({
        "attributes": {"POSITION": position, "NORMAL": normals, "TEXCOORD_0": st},
        "indices": indices,
        "material": material,
    })
}
