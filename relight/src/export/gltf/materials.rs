//! Materials, textures and images of a glTF.

use super::animation::{Motion, Track, film_track};
use super::pulse::Pulse;
use crate::export::images::Encoded;
use crate::export::layers::Layer;
use crate::export::look::{Alpha, Look, Picture, Slot, affine};
use crate::export::reflection::Reflection;
use crate::export::{Export, ExportError, Lightmaps, extras};
use crate::materials::finish::USUAL_REFLECTANCE;
use crate::world::WorldMaterial;
use glam::{Vec2, Vec3};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f32::consts::PI;
use std::sync::Arc;

/// Thickness that programs without rays give a liquid, id units.
const THICKNESS: f32 = 64.0;

/// How an image is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// It repeats.
    Repeat,
    /// It ends at its edge.
    Clamp,
    /// It ends at its edge, and has no smaller copies.
    Lightmap,
}

/// Textures and images, each once.
#[derive(Default)]
pub struct Textures {
    /// The images, in order.
    pub images: Vec<Arc<Encoded>>,
    by_hash: HashMap<u64, Vec<usize>>,
    textures: Vec<Value>,
    known: HashMap<(usize, Sampling), usize>,
    samplers: Vec<Sampling>,
}

impl Textures {
    /// The number of the texture with an image.
    pub fn add(&mut self, image: &Arc<Encoded>, sampling: Sampling) -> usize {
        let image = self.image(image);
        if let Some(&texture) = self.known.get(&(image, sampling)) {
            return texture;
        }
        let sampler = self
            .samplers
            .iter()
            .position(|s| *s == sampling)
            .unwrap_or_else(|| {
                self.samplers.push(sampling);
                self.samplers.len() - 1
            });
        self.textures
            .push(json!({"source": image, "sampler": sampler}));
        let texture = self.textures.len() - 1;
        self.known.insert((image, sampling), texture);
        texture
    }

    /// The number of an image: of those with the same content there is one.
    fn image(&mut self, image: &Arc<Encoded>) -> usize {
        let same = self.by_hash.entry(image.hash).or_default();
        let found = same.iter().copied().find(|&i| {
            self.images
                .get(i)
                .is_some_and(|known| known.bytes == image.bytes)
        });
        found.unwrap_or_else(|| {
            self.images.push(Arc::clone(image));
            same.push(self.images.len() - 1);
            self.images.len() - 1
        })
    }

    /// The `textures` and `samplers` of the document.
    pub fn finish(&self) -> (Vec<Value>, Vec<Value>) {
        let sampler = |sampling: &Sampling| match sampling {
            Sampling::Repeat => json!({"magFilter": 9729, "minFilter": 9987}),
            Sampling::Clamp => {
                json!({"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071})
            }
            Sampling::Lightmap => {
                json!({"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071})
            }
        };
        (
            self.textures.clone(),
            self.samplers.iter().map(sampler).collect(),
        )
    }
}

/// What materials are made with.
pub struct Maker<'a> {
    /// What is exported.
    pub source: &'a Export<'a>,
    /// Where images go.
    pub textures: &'a mut Textures,
    /// Names of extensions that were used.
    pub extensions: &'a mut BTreeSet<&'static str>,
    /// The lightmaps' texture.
    pub lightmap: Option<usize>,
    /// What moves, by where it is in the document.
    pub tracks: &'a mut Vec<Track>,
}

impl Maker<'_> {
    /// A material; `number`: its place in the document, `pulse`: how its factors change.
    ///
    /// # Errors
    /// [`ExportError`] when an image cannot be encoded.
    pub fn material(
        &mut self,
        number: usize,
        layer: &Layer<'_>,
        look: &Look,
        pulse: Option<&Pulse>,
    ) -> Result<Value, ExportError> {
        let material = &*layer.material;
        let reflection = &look.reflection;
        let mut base = json!({
            "metallicFactor": reflection.metal,
            "roughnessFactor": reflection.roughness,
        });
        let mut out = Map::new();
        let mut extensions = Map::new();
        out.insert("name".into(), json!(material.name));
        let place = format!("/materials/{number}");
        if let Value::Object(base) = &mut base {
            let slot = format!("{place}/pbrMetallicRoughness/baseColorTexture");
            if let Some(texture) = self.texture(material, look.color.as_ref(), &slot)? {
                base.insert("baseColorTexture".into(), texture);
            }
            if look.factor != glam::Vec4::ONE || pulse.is_some_and(Pulse::factor_varies) {
                base.insert("baseColorFactor".into(), json!(look.factor.to_array()));
            }
            let slot = format!("{place}/pbrMetallicRoughness/metallicRoughnessTexture");
            if let Some(texture) = self.texture(material, reflection.surface.as_ref(), &slot)? {
                base.insert("metallicRoughnessTexture".into(), texture);
            }
        }
        out.insert("pbrMetallicRoughness".into(), base);
        let slot = format!("{place}/normalTexture");
        if let Some(texture) = self.texture(material, reflection.normals.as_ref(), &slot)? {
            out.insert("normalTexture".into(), texture);
        }
        let peak = pulse.map_or(0.0, Pulse::brightest);
        let brightest = look.glow_factor.max_element().max(peak);
        let glows = brightest > 0.0 && brightest.is_finite();
        if let Some(pulse) = pulse {
            let strength = glows.then(|| brightest.max(1.0));
            self.tracks.push(pulse.track(&place, strength));
        }
        if glows {
            let slot = format!("{place}/emissiveTexture");
            if let Some(texture) = self.texture(material, look.glow.as_ref(), &slot)? {
                out.insert("emissiveTexture".into(), texture);
            }
            let factor = look.glow_factor.max(Vec3::ZERO) / brightest.max(1.0);
            out.insert(
                "emissiveFactor".into(),
                json!(factor.min(Vec3::ONE).to_array()),
            );
            if brightest > 1.0 {
                self.put(
                    &mut extensions,
                    "KHR_materials_emissive_strength",
                    json!({"emissiveStrength": brightest}),
                );
            }
        }
        match look.alpha {
            Alpha::Opaque => {}
            Alpha::Mask(cutoff) => {
                out.insert("alphaMode".into(), json!("MASK"));
                if cutoff != 0.5 {
                    out.insert("alphaCutoff".into(), json!(cutoff));
                }
            }
            Alpha::Blend => {
                out.insert("alphaMode".into(), json!("BLEND"));
            }
        }
        if look.two_sided {
            out.insert("doubleSided".into(), json!(true));
        }
        let shown = self.source.options.lightmaps == Lightmaps::Vertices;
        if shown {
            self.put(&mut extensions, "KHR_materials_unlit", json!({}));
        } else {
            self.reflectance(material, &place, reflection, &mut extensions)?;
        }
        // Light that a white surface shows as white is an irradiance of pi.
        let lightmap = self.lightmap.filter(|_| look.lightmapped);
        let lightmap =
            lightmap.map(|texture| json!({"index": texture, "texCoord": 1, "intensity": PI}));
        if let Some(lightmap) = lightmap.clone().filter(|_| !shown) {
            self.put(&mut extensions, "MOZ_lightmap", lightmap);
        }
        self.dielectric(look, &mut extensions);
        if !extensions.is_empty() {
            out.insert("extensions".into(), Value::Object(extensions));
        }
        let mut extras = extras::material(layer.whole, &self.source.finish(layer.whole));
        if let (Value::Object(extras), false) = (&mut extras, look.lost.is_empty()) {
            extras.insert("lost".into(), json!(look.lost));
        }
        if let (Value::Object(extras), Some(stage)) = (&mut extras, layer.stage()) {
            extras.insert("layer".into(), json!(stage));
        }
        let mut extras = json!({"material": extras});
        if let (Value::Object(extras), Some(lightmap), true) = (&mut extras, lightmap, shown) {
            extras.insert("lightmap".into(), lightmap);
        }
        out.insert("extras".into(), extras);
        Ok(Value::Object(out))
    }

    fn put(&mut self, extensions: &mut Map<String, Value>, name: &'static str, value: Value) {
        self.extensions.insert(name);
        extensions.insert(name.to_owned(), value);
    }

    /// Reflectance of the part that is no metal.
    fn reflectance(
        &mut self,
        material: &WorldMaterial,
        place: &str,
        reflection: &Reflection,
        extensions: &mut Map<String, Value>,
    ) -> Result<(), ExportError> {
        let Some(reflectance) = reflection.reflectance else {
            for (name, value) in diffuse() {
                self.put(extensions, name, value);
            }
            return Ok(());
        };
        let mut specular = Map::new();
        let factor = reflectance / USUAL_REFLECTANCE;
        if factor != Vec3::ONE {
            specular.insert("specularColorFactor".into(), json!(factor.to_array()));
        }
        let slot = format!("{place}/extensions/KHR_materials_specular/specularColorTexture");
        if let Some(texture) = self.texture(material, reflection.specular.as_ref(), &slot)? {
            specular.insert("specularColorTexture".into(), texture);
        }
        if !specular.is_empty() {
            self.put(extensions, "KHR_materials_specular", json!(specular));
        }
        Ok(())
    }

    fn dielectric(&mut self, look: &Look, extensions: &mut Map<String, Value>) {
        let Some(dielectric) = look.dielectric else {
            return;
        };
        let scale = self.source.options.scale;
        self.put(
            extensions,
            "KHR_materials_transmission",
            json!({"transmissionFactor": dielectric.transmission}),
        );
        self.put(
            extensions,
            "KHR_materials_ior",
            json!({"ior": dielectric.index}),
        );
        if let Some((color, distance)) = dielectric.liquid {
            self.put(
                extensions,
                "KHR_materials_volume",
                json!({
                    "thicknessFactor": THICKNESS * scale,
                    "attenuationColor": color.to_array(),
                    "attenuationDistance": distance * scale,
                }),
            );
        }
    }

    /// The reference to a slot's texture, at `place` in the document; `None` when there is no such image.
    pub fn texture(
        &mut self,
        material: &WorldMaterial,
        slot: Option<&Slot>,
        place: &str,
    ) -> Result<Option<Value>, ExportError> {
        let Some(slot) = slot else {
            return Ok(None);
        };
        let shader = &material.resolved.shader;
        let source = self.source;
        let Some(image) = source.picture(&slot.picture, shader)? else {
            return Ok(None);
        };
        let sampling = if slot.clamp {
            Sampling::Clamp
        } else {
            Sampling::Repeat
        };
        let mut reference = json!({"index": self.textures.add(&image, sampling)});
        if let (Picture::Film(film), Value::Object(map)) = (&slot.picture, &mut reference) {
            let side = if film.down { image.height } else { image.width };
            let (size, offset) = film.transform(0, side);
            self.extensions.insert("KHR_texture_transform");
            let transform = json!({"offset": offset.to_array(), "scale": size.to_array()});
            map.insert(
                "extensions".into(),
                json!({"KHR_texture_transform": transform}),
            );
            let place = format!("{place}/extensions/KHR_texture_transform");
            self.tracks.push(film_track(film, side, &place));
            return Ok(Some(reference));
        }
        if let Some(mut transform) = transform(slot)
            && let Value::Object(map) = &mut reference
        {
            self.extensions.insert("KHR_texture_transform");
            if self.source.options.animate {
                let place = format!("{place}/extensions/KHR_texture_transform");
                let motion = Motion::of(&slot.tc_mods, place);
                let track = motion.map(|motion| motion.track());
                let mut parts = track.iter().flat_map(|track| &track.parts);
                // what is animated is there to be animated
                if parts.any(|(pointer, ..)| pointer.ends_with("/rotation")) {
                    transform.entry("rotation").or_insert(json!(0.0));
                }
                self.tracks.extend(track);
            }
            map.insert(
                "extensions".into(),
                json!({"KHR_texture_transform": transform}),
            );
        }
        Ok(Some(reference))
    }
}

/// Extensions of a material that is diffuse alone. Without them programs add the reflection of an index of refraction
/// of 1.5. Blender before 4.0 ignores `specularFactor`, and the index where there is no `KHR_materials_specular`.
pub fn diffuse() -> BTreeMap<&'static str, Value> {
    BTreeMap::from([
        ("KHR_materials_ior", json!({"ior": 1.0})),
        ("KHR_materials_specular", json!({"specularFactor": 0.0})),
    ])
}

/// A matrix of texture coordinates as a rotation and scales, the form of glTF: rotation · scale. `None` for others.
pub fn turn_and_size(matrix: [Vec2; 2]) -> Option<(f32, Vec2)> {
    let [s, t] = matrix;
    // s is where the first coordinate goes: (size cos, -size sin)
    let angle = (-s.y).atan2(s.x);
    let (sin, cos) = angle.sin_cos();
    let size = Vec2::new(s.length(), t.dot(Vec2::new(sin, cos)));
    let again = Vec2::new(sin, cos) * size.y;
    let straight = (again - t).length() <= 1.0e-4 * (1.0 + t.length());
    (straight && size.is_finite() && angle.is_finite()).then_some((angle, size))
}

/// The texture transform of a slot; `None` if it has none, or none that glTF can represent.
fn transform(slot: &Slot) -> Option<Map<String, Value>> {
    if slot.tc_mods.is_empty() {
        return None;
    }
    let (matrix, offset) = affine(&slot.tc_mods, 0.0);
    let (angle, size) = turn_and_size(matrix)?;
    let mut map = Map::new();
    map.insert("offset".into(), json!(offset.to_array()));
    map.insert("scale".into(), json!(size.to_array()));
    if angle.abs() > 1.0e-6 {
        map.insert("rotation".into(), json!(angle));
    }
    offset.is_finite().then_some(map)
}
