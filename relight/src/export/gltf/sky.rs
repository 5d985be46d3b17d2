//! The sky of a glTF.

use super::Document;
use super::buffer::{Buffers, Kind};
use super::materials::Sampling;
use super::nodes::turn;
use crate::export::geometry::Geometry;
use crate::export::images::Encoded;
use crate::export::{ExportError, emission, extras, sky};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};
use std::sync::Arc;

impl Document<'_> {
    /// Adds the sky as a box around everything; `None` for a map without.
    pub(super) fn add_sky(&mut self, geometry: &Geometry) -> Result<Option<usize>, ExportError> {
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
            .filter(|r| r.max_element() > 0.0)
            .map(|r| r * source.exposure());
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
        let told = extras::material(material);
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
