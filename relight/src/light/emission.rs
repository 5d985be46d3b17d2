//! Whether and how strongly a material emits light: decided by its directives and stages, never by its name.
//!
//! In this order:
//!
//! 1. `q3map_surfacelight` and, on skies, `q3map_skylight`: the value given to the map compiler. The colour is
//!    `q3map_lightRGB`, else the mean of the light image, scaled to a largest channel of 1. The light image is the
//!    first that exists of `q3map_lightimage`, for skies the upper side of the sky box, `qer_editorimage`, an image
//!    of the material's name, the images of its stages; white without any.
//! 2. Glowing stages: the luminance of an opaque material's stages without incident light, averaged over texture
//!    and time, is at least [`GLOW_THRESHOLD`].
//!
//! Source: q3map2's choice of the light image; the algebra of stages is that of [`crate::materials::light`].

use super::entities::normalise;
use super::glow::{mean_emission, shades};
use super::{Emission, EmissionSource, Flicker, Shade, changes, raise};
use super::{POINT_LIGHT_INTENSITY, SKY_LIGHT_RADIANCE, SURFACE_LIGHT_RADIANCE};
use crate::files::GameFiles;
use crate::image::{self, Image};
use crate::materials::light::SurfaceClass;
use crate::overbright;
use crate::world::{Holes, WorldMaterial};
use glam::Vec3;
use shaderscript::{Cull, Deform, Shader};
use std::collections::HashMap;

impl Emission {
    /// Emission of a material from the sides that are drawn. A sky emits from its front regardless of its script:
    /// it is only seen from inside.
    pub(crate) fn of(material: &WorldMaterial, source: EmissionSource, strength: Vec3) -> Emission {
        let definition = material.resolved.definition();
        let sky = material.is_sky();
        let turns = |d: &Deform| matches!(d, Deform::AutoSprite | Deform::AutoSprite2);
        Emission {
            source,
            strength,
            two_sided: definition.cull == Cull::None && !sky,
            reversed: definition.cull == Cull::Back && !sky,
            turns_to_viewer: definition.deforms.iter().any(turns),
        }
    }
}

/// Smallest mean luminance (linear) at which an opaque material without directives is a light: a display grey of 37
/// %. Full-bright trim is dimmer; lamps, screens and lava are brighter.
pub const GLOW_THRESHOLD: f32 = 0.11;

/// Longest side of the image copies that means are computed from, texels.
const SAMPLE_SIDE: u32 = 64;

/// Light directives of a material: `q3map_surfacelight` and, of a sky, `q3map_skylight`; `None` without them.
pub(super) fn directed(material: &WorldMaterial) -> Option<(f32, f32)> {
    let light = &material.resolved.definition().light;
    let positive = |v: Option<f32>| v.filter(|v| v.is_finite() && *v > 0.0).unwrap_or(0.0);
    let surface_light = positive(light.surface_light);
    let dome = match material.is_sky() {
        true => positive(light.sky_light.map(|(value, _)| value)),
        false => 0.0,
    };
    (surface_light > 0.0 || dome > 0.0).then_some((surface_light, dome))
}

/// Images of the sides of a sky's box.
fn sky_sides(material: &WorldMaterial) -> Vec<String> {
    let sky = material.resolved.definition().sky.as_ref();
    let outer = sky.and_then(|sky| sky.outer.as_ref());
    let sides = |outer| ["rt", "lf", "bk", "ft", "up", "dn"].map(|side| format!("{outer}_{side}"));
    outer.map(sides).into_iter().flatten().collect()
}

/// Computes what materials emit; keeps small copies of the images.
pub(crate) struct Finder<'a> {
    files: &'a dyn GameFiles,
    images: HashMap<String, Option<Image>>,
    /// What ratios of channels are raised to: see [`LightColor`](super::LightColor).
    exponent: f32,
}

impl<'a> Finder<'a> {
    pub fn new(files: &'a dyn GameFiles, exponent: f32) -> Self {
        Finder {
            files,
            images: HashMap::new(),
            exponent,
        }
    }

    /// Emission of a material.
    pub fn emission(&mut self, material: &WorldMaterial) -> Option<Emission> {
        let definition = material.resolved.definition();
        let sky = material.is_sky();
        if let Some((surface_light, dome)) = directed(material) {
            // The compiler scales its colour to a largest channel of 1; this one has the same luminance.
            let color = raise(self.light_color(definition), self.exponent);
            let (source, strength) = if sky {
                (
                    EmissionSource::Sky,
                    surface_light * SURFACE_LIGHT_RADIANCE + dome * SKY_LIGHT_RADIANCE,
                )
            } else if definition.deforms.contains(&Deform::AutoSprite) {
                (
                    EmissionSource::Sprite,
                    surface_light * POINT_LIGHT_INTENSITY,
                )
            } else {
                (
                    EmissionSource::SurfaceLight,
                    surface_light * SURFACE_LIGHT_RADIANCE,
                )
            };
            return Some(Emission::of(material, source, color * strength));
        }
        let solid = matches!(
            material.class.class,
            SurfaceClass::Opaque | SurfaceClass::CutOut
        );
        if !solid || sky {
            return None;
        }
        let shown = self.shown(material);
        (overbright::luminance(shown) >= GLOW_THRESHOLD)
            .then(|| Emission::of(material, EmissionSource::Glow, shown))
    }

    /// Mean radiance of a material's stages without incident light.
    pub fn shown(&mut self, material: &WorldMaterial) -> Vec3 {
        let shader = &material.resolved.shader;
        if material.resolved.fault.is_some() {
            return Vec3::ZERO;
        }
        if crate::materials::light::is_glowing(shader) {
            for name in shader.image_names() {
                self.image(name);
            }
        }
        mean_emission(shader, |name| self.images.get(name)?.as_ref())
    }

    /// Reflectances over a material's texture, for these corner colours. Empty for skies.
    pub fn shades(&mut self, material: &WorldMaterial, corners: [u8; 4]) -> Vec<Shade> {
        let shader = &material.resolved.shader;
        if material.is_sky() {
            return Vec::new();
        }
        for name in shader.image_names() {
            self.image(name);
        }
        shades(shader, material.lighting, corners, |name| {
            self.images.get(name)?.as_ref()
        })
    }

    /// The transparent texels of a cut-out.
    pub fn holes(&self, material: &WorldMaterial) -> Option<Holes> {
        if material.class.class != SurfaceClass::CutOut {
            return None;
        }
        let shader = &material.resolved.shader;
        // From the full image: alpha tests against 0 would fill small holes in the copy.
        let load = |name: &str| image::load(self.files, name).ok().flatten();
        Holes::of(shader, material.class.two_sided, |name| Some(load(name)?.0))
    }

    /// Mean radiance of a sky: the existing sides of its box, and its clouds.
    pub fn sky_radiance(&mut self, material: &WorldMaterial) -> Vec3 {
        let clouds = self.shown(material);
        let mut sum = Vec3::ZERO;
        let mut sides = 0.0f32;
        for name in sky_sides(material) {
            if let Some(image) = self.image(&name) {
                sum += image.mean_linear();
                sides += 1.0;
            }
        }
        clouds + sum / sides.max(1.0)
    }

    /// Colour of the directives' light, largest channel 1: the mean of the display-encoded image.
    fn light_color(&mut self, definition: &Shader) -> Vec3 {
        let encode = |c: Vec3| Vec3::from_array(c.to_array().map(overbright::from_linear));
        let stages = definition.image_names().collect();
        let last = [vec![definition.name.as_str()], stages].concat();
        self.color_by(definition, &last, |image| encode(image.mean_linear()))
    }

    /// The same as q3map2 computes it: from the mean of the image's bytes. Without `qer_editorimage` it prefers the
    /// image of the first stage to that of the material's name.
    pub(super) fn compiler_color(&mut self, definition: &Shader) -> Vec3 {
        let deduced = match definition.light.editor_image {
            None => definition.image_names().next(),
            Some(_) => None,
        };
        let last: Vec<&str> = deduced
            .into_iter()
            .chain([definition.name.as_str()])
            .collect();
        self.color_by(definition, &last, Image::mean_stored)
    }

    /// Colour by `q3map_lightRGB`, or by the first image that exists; `last`: those after the ones that directives name.
    fn color_by(
        &mut self,
        definition: &Shader,
        last: &[&str],
        mean: impl Fn(&Image) -> Vec3,
    ) -> Vec3 {
        let light = &definition.light;
        if let Some(rgb) = light.light_rgb {
            return normalise(rgb.max(Vec3::ZERO));
        }
        let sky_side = definition
            .sky
            .as_ref()
            .and_then(|sky| Some(format!("{}_up", sky.outer.as_ref()?)));
        let mut names: Vec<&str> = Vec::new();
        names.extend(light.light_image.as_deref());
        names.extend(sky_side.as_deref());
        names.extend(light.editor_image.as_deref());
        names.extend(last);
        let mean = names
            .into_iter()
            .find_map(|name| self.image(name).map(&mean));
        mean.map_or(Vec3::ONE, normalise)
    }

    /// The small copy of an image that was loaded before.
    pub(super) fn kept(&self, name: &str) -> Option<&Image> {
        self.images.get(name)?.as_ref()
    }

    /// The small copy of an image, if the image exists.
    pub(super) fn image(&mut self, name: &str) -> Option<&Image> {
        if !self.images.contains_key(name) {
            self.prepare(&[name]);
        }
        self.images.get(name)?.as_ref()
    }

    /// Loads images, as far as they are not loaded.
    fn prepare(&mut self, names: &[&str]) {
        let mut names = names.to_vec();
        names.sort_unstable();
        names.dedup();
        names.retain(|name| !self.images.contains_key(*name));
        let loaded = image::load_all(self.files, &names, |mut image| {
            while image.width.max(image.height) > SAMPLE_SIDE {
                image = image.halve();
            }
            image
        });
        for (name, loaded) in names.into_iter().zip(loaded) {
            let small = loaded.unwrap_or_else(|problem| {
                log::warn!("{problem}");
                None
            });
            self.images.insert(name.to_owned(), small);
        }
    }

    /// Loads what [`shades`](Self::shades) and [`sky_radiance`](Self::sky_radiance) need of materials, on all cores.
    pub fn prepare_materials(&mut self, materials: &[WorldMaterial]) {
        let (skies, others): (Vec<_>, Vec<_>) = materials.iter().partition(|m| m.is_sky());
        let sides: Vec<String> = skies.into_iter().flat_map(sky_sides).collect();
        let stages = others
            .into_iter()
            .flat_map(|m| m.resolved.shader.image_names());
        let names: Vec<&str> = sides.iter().map(String::as_str).chain(stages).collect();
        self.prepare(&names);
    }
}

impl Finder<'_> {
    /// Change over time of an emitting material; `None` if it is constant.
    pub fn flicker(&mut self, material: &WorldMaterial) -> Option<Flicker> {
        material.emission?;
        let shader = &material.resolved.shader;
        if material.resolved.fault.is_some() || !shader.stages.iter().any(changes) {
            return None;
        }
        for name in shader.image_names() {
            self.image(name);
        }
        Flicker::of(shader, |name| self.kept(name))
    }
}
