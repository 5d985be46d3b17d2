//! The sky of a glTF.

use super::Document;
use super::buffer::{Buffers, Kind};
use super::materials::{Sampling, diffuse};
use super::nodes::turn;
use crate::export::geometry::Geometry;
use crate::export::images::Encoded;
use crate::export::look::Picture;
use crate::export::{ExportError, ImagePlace, Sky, emission, extras, sky};
use crate::overbright::luminance;
use glam::{Vec3, Vec4};
use serde_json::{Value, json};
use std::sync::Arc;
use support::Aabb;

impl Document<'_> {
    /// Adds the sky around everything; `None` for a map without.
    pub(super) fn add_sky(&mut self, geometry: &Geometry) -> Result<Option<usize>, ExportError> {
        let source = self.source;
        let world = source.world;
        let material = world.sky.and_then(|m| world.materials.get(m as usize));
        let Some(material) = material.filter(|_| source.options.sky != Sky::Strip) else {
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
        if source.options.images == ImagePlace::None {
            return Ok(None);
        }
        let shader = sky::definition(material);
        let mut wanted: Vec<Option<Picture>> = (0..6)
            .map(|side| sky::picture(source.files, material, side))
            .collect();
        let round = source.options.sky == Sky::Panorama && wanted.iter().any(Option::is_some);
        if round {
            wanted = vec![Some(Picture::Panorama(material.name.to_ascii_lowercase()))];
        }
        let mut pictures = Vec::new();
        let mut mean = Vec4::ZERO;
        for picture in &wanted {
            let image = match picture {
                Some(picture) => source.picture(picture, shader)?,
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
                luminance(radiance) / luminance(shown).max(1.0e-3)
            }
            _ => 1.0,
        };
        let mut primitives = Vec::new();
        let mut plain = None;
        for (side, image) in pictures.iter().enumerate() {
            let number = match image {
                Some(image) => {
                    let name = match round {
                        true => material.name.clone(),
                        false => format!("{} side {side}", material.name),
                    };
                    self.sky_material(&name, Some(image), Vec3::splat(strength))
                }
                None => *plain.get_or_insert_with(|| {
                    let color = radiance.filter(|_| shown.is_none()).unwrap_or(Vec3::ZERO);
                    self.sky_material(&material.name, None, color)
                }),
            };
            let scale = source.options.scale;
            if round {
                let place = |p: Vec3| turn(middle + p * radius) * scale;
                primitives.push(ball(&mut self.buffers, place, number));
                continue;
            }
            let corners = [(-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)];
            let positions = corners.map(|(s, t)| {
                turn(middle + shaderscript::Sky::side_point(side, s, t) * radius) * scale
            });
            let normal = turn(-shaderscript::Sky::side_point(side, 0.0, 0.0));
            primitives.push(quad(&mut self.buffers, positions, normal, number));
        }
        self.meshes
            .push(json!({"name": "sky", "primitives": primitives}));
        let mesh = self.meshes.len() - 1;
        let extras = extras::material(material, &self.source.finish(material));
        Ok(Some(self.nodes.add(json!({
            "name": "sky",
            "mesh": mesh,
            "extras": {"material": extras, "radiance": radiance.map(|r| r.to_array())},
        }))))
    }

    /// A material that shines with a radiance, times a picture if it has one, and reflects nothing.
    fn sky_material(&mut self, name: &str, image: Option<&Arc<Encoded>>, radiance: Vec3) -> usize {
        let brightest = radiance.max_element().max(1.0);
        let mut extensions = diffuse();
        if brightest > 1.0 {
            let strength = json!({"emissiveStrength": brightest});
            extensions.insert("KHR_materials_emissive_strength", strength);
        }
        self.extensions.extend(extensions.keys());
        let mut material = json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.0, 0.0, 0.0, 1.0],
                "metallicFactor": 0.0,
            },
            "emissiveFactor": (radiance / brightest).to_array(),
            "extensions": extensions,
        });
        if let Some(image) = image {
            let texture = self.textures.add(image, Sampling::Clamp);
            material["emissiveTexture"] = json!({"index": texture});
        }
        self.materials.push(material);
        self.materials.len() - 1
    }
}

/// A side of the sky: corners from above left, counter-clockwise.
fn quad(buffers: &mut Buffers, positions: [Vec3; 4], normal: Vec3, material: usize) -> Value {
    let position = buffers.add_floats(Kind::Vec3, positions.iter().map(|p| p.to_array()));
    let bounds = Aabb::of(positions);
    buffers.bound(position, &bounds.mins.to_array(), &bounds.maxs.to_array());
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

/// The sky as a ball with one picture all round, seen from inside. `place`: where a point of the unit ball goes.
fn ball(buffers: &mut Buffers, place: impl Fn(Vec3) -> Vec3, material: usize) -> Value {
    const COLUMNS: u16 = 64;
    const ROWS: u16 = 32;
    // the flat parts of the ball are nearer than its corners
    const WIDER: f32 = 1.01;
    let (mut positions, mut normals, mut st) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..=ROWS {
        for column in 0..=COLUMNS {
            let u = f32::from(column) / f32::from(COLUMNS);
            let v = f32::from(row) / f32::from(ROWS);
            let direction = sky::direction(u, v);
            positions.push(place(direction * WIDER).to_array());
            normals.push(turn(-direction).normalize().to_array());
            st.push([u, v]);
        }
    }
    let mut indices: Vec<u8> = Vec::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let above = row * (COLUMNS + 1) + column;
            let below = above + COLUMNS + 1;
            // counter-clockwise from inside; at the poles one of the two has no area
            let upper = [above, below + 1, above + 1].map(|i| (i, row > 0));
            let lower = [above, below, below + 1].map(|i| (i, row + 1 < ROWS));
            for (index, there) in upper.into_iter().chain(lower) {
                if there {
                    indices.extend(index.to_le_bytes());
                }
            }
        }
    }
    let bounds = Aabb::of(positions.iter().map(|p| Vec3::from_array(*p)));
    let count = indices.len() / 2;
    let position = buffers.add_floats(Kind::Vec3, positions.into_iter());
    buffers.bound(position, &bounds.mins.to_array(), &bounds.maxs.to_array());
    let normal = buffers.add_floats(Kind::Vec3, normals.into_iter());
    let st = buffers.add_floats(Kind::Vec2, st.into_iter());
    let indices = buffers.add(Kind::Short, &indices, count);
    json!({
        "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": st},
        "indices": indices,
        "material": material,
    })
}
