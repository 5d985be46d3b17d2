//! glTF 2.0, binary and text.
//!
//! Light is in the units of [`crate::light`], times the map's exposure: a radiance of 1 is display white. glTF's
//! photometric units are taken to be these: what is white here shines with one candela per square metre there, and lights
//! keep their proportions to it. So a program that shows radiance as it is, as most do, shows the map as bright as the
//! game does.

mod animation;
mod buffer;
mod entity_models;
mod materials;
mod moving;
mod nodes;
mod primitive;
mod pulse;
mod sky;

use super::geometry::{self, Geometry, Part};
use super::images::Encoded;
use super::layers::{Layer, layers};
use super::lightmaps::Atlas;
use super::look::Look;
use super::output::Output;
use super::{Export, ExportError, ExportReport, ImagePlace, Lightmaps, emission, vertex_light};
use crate::image::Image;
use crate::world::{RelitWorld, WorldMaterial, WorldVertex};
use buffer::Buffers;
use glam::{Vec2, Vec3};
use materials::{Maker, Sampling, Textures};
use moving::{Lighting, look_in, make_moving};
use nodes::Nodes;
use primitive::primitive;
use pulse::Pulse;
use serde_json::{Map, Value, json};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use support::slice;

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
    tracks: Vec<animation::Track>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Nodes,
    lightmap: Option<usize>,
    /// Triangles and vertices of layers over others.
    layered: (usize, usize),
    warnings: Vec<String>,
}

/// A material in the document.
struct Made {
    number: usize,
    look: Look,
    /// Whether light in colours of vertices multiplies it.
    shaded: bool,
}

/// A layer of a material in the document.
struct MadeLayer<'a> {
    layer: Layer<'a>,
    made: Made,
}

/// Light of vertices.
struct Baked {
    /// For every part in order, where it is lit by lightmaps, the colour of each vertex.
    colors: Vec<Option<Vec<Vec3>>>,
    /// For every material the mean light on it.
    means: Vec<Option<Vec3>>,
}

impl Baked {
    /// Finds the light; `atlas`: all lightmaps.
    fn new(world: &RelitWorld, geometry: &Geometry, atlas: Option<&Image>) -> Baked {
        let lit = |part: &Part| {
            let material = world.materials.get(part.material as usize)?;
            let atlas = atlas.filter(|_| vertex_light::is_lightmapped(material))?;
            Some(vertex_light::fit(part, atlas))
        };
        let colors: Vec<Option<Vec<Vec3>>> = geometry.parts().map(lit).collect();
        let means = vertex_light::means(
            world,
            geometry.parts().zip(colors.iter().map(Option::as_deref)),
        );
        Baked { colors, means }
    }
}

/// Writes `NAME.glb`, or `NAME.gltf` with `NAME.bin`, and images where they are not inside.
pub(super) fn write(
    source: &Export<'_>,
    container: Container,
    output: &mut Output,
) -> Result<ExportReport, ExportError> {
    let world = source.world;
    let keep = source.options.lightmaps != Lightmaps::Strip;
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
        tracks: Vec::new(),
        materials: Vec::new(),
        meshes: Vec::new(),
        nodes: Nodes::default(),
        lightmap: None,
        layered: (0, 0),
        warnings: Vec::new(),
    };
    let pages = atlas.map(|atlas| atlas.image(world)).transpose()?;
    let seen = source.options.images != ImagePlace::None;
    if let Some(pages) = pages.as_ref().filter(|_| seen) {
        let image = Encoded::png(pages, &format!("{}_lightmaps", output.stem()))?;
        let texture = document.textures.add(&Arc::new(image), Sampling::Lightmap);
        document.lightmap = Some(texture);
    }
    let baked = (source.options.lightmaps == Lightmaps::Vertices)
        .then(|| Baked::new(world, &geometry, pages.as_ref()));
    drop(pages);
    let meshes = document.add_meshes(&geometry, baked.as_ref())?;
    let models = document.add_entity_models(baked.is_some())?;
    let mut top = document.nodes.add_entities(source, &meshes, &models.meshes);
    top.extend(document.nodes.add_fogs(source));
    top.extend(document.add_sky(&geometry)?);
    if source.options.lights {
        top.extend(document.nodes.add_lights(source));
    }
    let report = ExportReport {
        files: Vec::new(),
        triangles: geometry.triangles() + document.layered.0 + models.triangles,
        degenerate: geometry.degenerate + models.degenerate,
        vertices: geometry.vertices() + document.layered.1 + models.vertices,
        materials: document.materials.len(),
        images: document.textures.images.len(),
        warnings: std::mem::take(&mut document.warnings),
    };
    document.finish(container, top, output)?;
    Ok(report)
}

impl Document<'_> {
    /// Adds the meshes of all models with the materials that they need; for every model its mesh. `baked`: light for
    /// materials that are to need none.
    fn add_meshes(
        &mut self,
        geometry: &Geometry,
        baked: Option<&Baked>,
    ) -> Result<Vec<Option<usize>>, ExportError> {
        let world = self.source.world;
        let radiances = emission::radiances(world);
        let mut numbers: BTreeMap<u32, Vec<MadeLayer<'_>>> = BTreeMap::new();
        let mut out = Vec::with_capacity(geometry.models.len());
        let mut lights = baked.iter().flat_map(|b| &b.colors);
        for (model, mesh) in geometry.models.iter().enumerate() {
            let mut primitives = Vec::with_capacity(mesh.parts.len());
            for part in &mesh.parts {
                let light = lights.next().and_then(Option::as_deref);
                let Some(material) = slice::get(&world.materials, part.material as usize) else {
                    continue;
                };
                let made = match numbers.entry(part.material) {
                    Entry::Occupied(known) => known.into_mut(),
                    Entry::Vacant(place) => {
                        let index = part.material as usize;
                        let radiance = radiances.get(index).copied();
                        let shown = baked.map(|baked| {
                            let mean = baked.means.get(index).copied().flatten();
                            mean.unwrap_or(Vec3::ONE)
                        });
                        let lighting = Lighting { radiance, shown };
                        let bounds = geometry.coordinates(part.material);
                        place.insert(self.add_layers(material, lighting, bounds)?)
                    }
                };
                primitives.extend(self.layer_primitives(part, light, made));
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

    /// Adds a material for each layer of a map's. `bounds`: least and largest texture coordinates of its surfaces.
    fn add_layers<'m>(
        &mut self,
        material: &'m WorldMaterial,
        lighting: Lighting,
        bounds: Option<(Vec2, Vec2)>,
    ) -> Result<Vec<MadeLayer<'m>>, ExportError> {
        let mut out = Vec::new();
        for layer in layers(material) {
            let radiance = lighting.radiance.filter(|_| layer.stage().is_none());
            let lighting = Lighting {
                radiance,
                ..lighting
            };
            let (mut look, shaded) = look_in(self.source, &layer, lighting);
            let pulse = make_moving(self.source, &layer, lighting, &mut look, bounds);
            layer.weigh(self.source, &mut look);
            let number = self.add_material(&layer, &look, pulse.as_ref())?;
            let name = &layer.material.name;
            let lost = look.lost.iter();
            self.warnings
                .extend(lost.map(|l| format!("material {name}: {l}")));
            let shaded = shaded && vertex_light::is_lightmapped(&layer.material);
            let made = Made {
                number,
                look,
                shaded,
            };
            out.push(MadeLayer { layer, made });
        }
        Ok(out)
    }

    /// A part once for each layer of its material; `light`: of its vertices.
    fn layer_primitives(
        &mut self,
        part: &Part,
        light: Option<&[Vec3]>,
        layers: &[MadeLayer<'_>],
    ) -> Vec<Value> {
        let mut out = Vec::with_capacity(layers.len());
        for (height, MadeLayer { layer, made }) in layers.iter().enumerate() {
            let light = light.filter(|_| made.shaded);
            let (look, number) = (&made.look, made.number);
            if height == 0 {
                let base = primitive(&mut self.buffers, self.source, part, light, look, number);
                out.push(base);
                continue;
            }
            let seen = |corners: [WorldVertex; 3]| corners.iter().any(|v| layer.cover(v) > 0.0);
            let (upper, from) = layer.raise(part, height, look, &seen);
            if upper.indices.is_empty() {
                continue;
            }
            self.layered.0 += upper.indices.len() / 3;
            self.layered.1 += upper.vertices.len();
            let light: Option<Vec<Vec3>> = light.map(|light| {
                let of = |&i: &usize| light.get(i).copied().unwrap_or(Vec3::ONE);
                from.iter().map(of).collect()
            });
            let light = light.as_deref();
            out.push(primitive(
                &mut self.buffers,
                self.source,
                &upper,
                light,
                look,
                number,
            ));
        }
        out
    }

    fn add_material(
        &mut self,
        layer: &Layer<'_>,
        look: &Look,
        pulse: Option<&Pulse>,
    ) -> Result<usize, ExportError> {
        let number = self.materials.len();
        let made = self.maker().material(number, layer, look, pulse)?;
        self.materials.push(made);
        Ok(number)
    }

    fn maker(&mut self) -> Maker<'_> {
        Maker {
            source: self.source,
            textures: &mut self.textures,
            extensions: &mut self.extensions,
            lightmap: self.lightmap,
            tracks: &mut self.tracks,
        }
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
        let animations: Vec<Value> = std::mem::take(&mut self.tracks)
            .iter()
            .enumerate()
            .map(|(number, track)| {
                track.animation(&mut self.buffers, &format!("material_{number}"))
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
            ImagePlace::Beside | ImagePlace::None => false,
        };
        let mut images = Vec::with_capacity(self.textures.images.len());
        for image in &self.textures.images {
            let mut entry = json!({"name": image.path});
            if inside {
                bytes.resize(bytes.len().next_multiple_of(4), 0);
                views.push(json!({
                    "buffer": 0,
                    "byteOffset": bytes.len(),
                    "byteLength": image.bytes.len(),
                }));
                bytes.extend_from_slice(&image.bytes);
                entry["bufferView"] = json!(views.len() - 1);
                entry["mimeType"] = json!(image.mime.text());
            } else {
                let path = format!("images/{}", image.path);
                output.write_beside(&path, &image.bytes)?;
                entry["uri"] = json!(escaped(&path));
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
        let mut extras = json!({
            "map": world.name,
            "scale": source.options.scale,
            "axes": "id units (x, y, z) are scale * (x, z, -y)",
            "exposure": source.exposure(),
            "ambient": world.ambient.to_array(),
        });
        if let (Value::Object(map), false) = (&mut extras, flares.is_empty()) {
            map.insert("flares".into(), json!(flares));
        }
        root.insert(
            "asset".into(),
            json!({
                "version": "2.0",
                "generator": concat!("relight ", env!("CARGO_PKG_VERSION")),
                "extras": extras,
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
