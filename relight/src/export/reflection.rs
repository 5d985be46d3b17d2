//! How surfaces reflect: what packs and files by hand state, in the terms of other programs.

use super::layers::Layer;
use super::look::{Alpha, Dielectric, Look, Picture, SURROUNDINGS, Slot};
use super::{Export, ImagePlace};
use crate::files::GameFiles;
use crate::image::Image;
use crate::materials::finish::{Finish, MapFault, NormalMap, SurfaceMap, USUAL_REFLECTANCE};
use crate::materials::light::SurfaceClass;
use crate::overbright;
use crate::world::WorldMaterial;
use glam::{Vec2, Vec3};
use shaderscript::{Shader, TcGen, TcMod};

/// Least luminance of the mirrored part of light with which a surface is a mirror.
const LEAST_MIRROR: f32 = 0.5;

/// How a surface reflects.
#[derive(Debug, Clone, PartialEq)]
pub struct Reflection {
    /// Perceptual roughness; a factor of that of `surface`.
    pub roughness: f32,
    /// Part that is metal; a factor of that of `surface`.
    pub metal: f32,
    /// Reflectance at normal incidence of the part that is no metal, linear; a factor of that of `specular`. `None`:
    /// that part is diffuse alone.
    pub reflectance: Option<Vec3>,
    /// Roughness (green) and metal (blue).
    pub surface: Option<Slot>,
    /// Reflectance, display-encoded.
    pub specular: Option<Slot>,
    /// Normals in tangent space.
    pub normals: Option<Slot>,
}

impl Reflection {
    /// All directions alike.
    pub const DIFFUSE: Reflection = Reflection {
        roughness: 1.0,
        metal: 0.0,
        reflectance: None,
        surface: None,
        specular: None,
        normals: None,
    };

    /// As most materials that are no metal, with this roughness.
    pub fn usual(roughness: f32) -> Reflection {
        Reflection {
            roughness,
            reflectance: Some(Vec3::splat(USUAL_REFLECTANCE)),
            ..Reflection::DIFFUSE
        }
    }

    /// A mirror of the surface's colour.
    pub fn mirror() -> Reflection {
        Reflection {
            metal: 1.0,
            ..Reflection::usual(0.0)
        }
    }

    /// Whether it has an image.
    pub fn has_pictures(&self) -> bool {
        self.surface.is_some() || self.specular.is_some() || self.normals.is_some()
    }
}

/// An image of reflection that no file of the game holds in the form of other programs.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ReflectionImage {
    /// Roughness in green and metal in blue.
    RoughnessMetal(SurfaceMap),
    /// Roughness in green from the smoothness of a map of reflectance. The byte: roughness where that is 1.
    Roughness(SurfaceMap, u8),
    /// Reflectance, display-encoded, without the smoothness.
    Reflectance(SurfaceMap),
    /// Normals of an image after scaling. The factors: bits of the numbers.
    Normals(String, [u32; 2]),
}

impl ReflectionImage {
    /// The image, and where it goes; `None`, with a line in the log, when it cannot be read.
    pub fn load(&self, files: &dyn GameFiles) -> Option<(Image, String)> {
        let surface = |map: &SurfaceMap, label: &str| {
            let image = map.load(files).unwrap_or_else(|problem| {
                log::warn!("{problem}");
                None
            })?;
            Some((image, format!("{}_{label}", map.image())))
        };
        Some(match self {
            ReflectionImage::RoughnessMetal(map) => {
                let (image, path) = surface(map, "roughness")?;
                (opaque(image, |rgb, _| rgb), path)
            }
            ReflectionImage::Roughness(map, least) => {
                let (image, path) = surface(map, &format!("roughness_{least}"))?;
                let smooth = u32::from(255 - least);
                let rough = |alpha: u8| 255 - ((u32::from(alpha) * smooth + 127) / 255) as u8;
                (opaque(image, |_, alpha| [255, rough(alpha), 255]), path)
            }
            ReflectionImage::Reflectance(map) => {
                let (image, path) = surface(map, "reflectance")?;
                (opaque(image, |rgb, _| rgb), path)
            }
            ReflectionImage::Normals(name, scale) => {
                let scale = Vec2::from_array(scale.map(f32::from_bits));
                let (image, _) = super::images::load(files, name)?;
                let path = match scale.to_array() {
                    [1.0, -1.0] => format!("{name}_up"),
                    [x, y] => format!("{name}_scaled_{x}_{y}"),
                };
                (opaque(image, |rgb, _| scaled_normal(rgb, scale)), path)
            }
        })
    }
}

/// An image with other texels, without alpha.
fn opaque(mut image: Image, texel: impl Fn([u8; 3], u8) -> [u8; 3]) -> Image {
    for pixel in image.rgba.as_chunks_mut().0 {
        let [r, g, b, a] = *pixel;
        let [r, g, b] = texel([r, g, b], a);
        *pixel = [r, g, b, 255];
    }
    image.has_alpha = false;
    image
}

/// A normal whose parts along the surface are multiplied; the third completes them to unit length.
fn scaled_normal([x, y, _]: [u8; 3], scale: Vec2) -> [u8; 3] {
    let along = (Vec2::new(f32::from(x), f32::from(y)) / 127.5 - 1.0) * scale;
    let normal = along.extend((1.0 - along.length_squared()).max(0.0).sqrt());
    let normal = normal.normalize_or(Vec3::Z);
    (normal * 127.5 + 128.0).to_array().map(|v| v as u8)
}

/// The pictures of a map of roughness and metal, and of one of reflectance. `roughness`: where its smoothness is 1.
fn pictures(map: &SurfaceMap, roughness: f32) -> (Picture, Option<Picture>) {
    let made = Picture::Reflection;
    match map {
        SurfaceMap::RoughnessMetal(name) => (Picture::File(name.clone()), None),
        SurfaceMap::Specular(_) | SurfaceMap::Gloss { .. } => {
            let least = (roughness.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            let rough = ReflectionImage::Roughness(map.clone(), least);
            let reflectance = ReflectionImage::Reflectance(map.clone());
            (made(rough), Some(made(reflectance)))
        }
        _ => (made(ReflectionImage::RoughnessMetal(map.clone())), None),
    }
}

/// The picture of a normal map. glTF keeps the third component of a scaled normal, and programs differ in what they do:
/// scaled normals are an image of their own.
fn normals(map: &NormalMap) -> Picture {
    let name = map.image.clone();
    if map.scale == Vec2::ONE {
        return Picture::File(name);
    }
    let scale = map.scale.to_array().map(f32::to_bits);
    Picture::Reflection(ReflectionImage::Normals(name, scale))
}

/// Changes to the texture coordinates of the first texture, which maps lie on.
fn texture_mods(shader: &Shader) -> Vec<TcMod> {
    let mut stages = shader.stages.iter();
    let texture = stages.find(|stage| stage.tc_gen != TcGen::Lightmap);
    texture.map_or_else(Vec::new, |stage| stage.tc_mods.clone())
}

/// Whether rays meet a body of the material, so that it can be rough, metal or glass.
fn has_body(class: SurfaceClass) -> bool {
    use SurfaceClass::{Fog, Invisible, Mirror, Portal, Sky};
    !matches!(class, Sky | Fog | Invisible | Portal | Mirror)
}

impl Export<'_> {
    /// What packs and files by hand state about a material.
    pub(super) fn finish(&self, material: &WorldMaterial) -> Finish {
        let (shader, by_hand) = (&material.resolved.shader, &self.world.by_hand);
        self.materials
            .finish(self.files, &material.name, shader, by_hand)
    }

    /// Makes the look of a layer one that reflects as it is stated of its material.
    pub(super) fn reflect(&self, layer: &Layer<'_>, finish: &Finish, look: &mut Look) {
        let class = layer.whole.class;
        if !has_body(class.class) {
            return;
        }
        if finish.plain {
            look.reflection = Reflection::DIFFUSE;
            for line in &mut look.lost {
                *line = line.replace(SURROUNDINGS, "a picture of the surroundings; left out");
            }
        }
        if let Some((index, part)) = finish.glass {
            make_glass(index, part, finish.roughness.unwrap_or(0.0), look);
        } else if !class.translucent {
            self.add_gloss(layer.whole, finish.clone(), look);
        }
        if let Some(mirror) = finish.mirror {
            make_mirror(mirror, look);
        }
        if let Some(glow) = &finish.glow {
            let picture = Picture::File(glow.image.clone());
            if self.mean(layer.whole, &picture).is_some() {
                look.glow = Some(Slot {
                    tc_mods: texture_mods(&layer.whole.resolved.shader),
                    ..Slot::plain(picture)
                });
                look.glow_factor = Vec3::splat(glow.radiance);
            } else if self.options.images != ImagePlace::None {
                look.lost
                    .push(MapFault::NoGlow(glow.image.clone()).to_string());
            }
        }
    }

    /// Roughness, metal, reflectance and normals. An image that cannot be used is told in `lost`.
    fn add_gloss(&self, material: &WorldMaterial, mut finish: Finish, look: &mut Look) {
        if self.options.images == ImagePlace::None {
            finish = finish.without_surface();
            finish.normals = None;
        }
        let shader = &material.resolved.shader;
        let on_texture = |picture: Picture| Slot {
            tc_mods: texture_mods(shader),
            ..Slot::plain(picture)
        };
        let exists = |picture: &Picture| matches!(self.picture(picture, shader), Ok(Some(_)));
        let pictured = |finish: &Finish| {
            let map = finish.surface.as_ref()?;
            Some(pictures(map, finish.roughness_or_usual()))
        };
        let found = pictured(&finish).is_some_and(|(surface, _)| exists(&surface));
        let mean = (finish.normals.as_ref())
            .and_then(|map| self.mean(material, &Picture::File(map.image.clone())));
        let checks = [
            finish.check_surface(found),
            finish.check_normals(mean.map(|mean| mean.truncate())),
        ];
        let faults = checks.into_iter().filter_map(Result::err);
        look.lost.extend(faults.map(|fault| fault.to_string()));
        if finish.is_rough() {
            let (surface, specular) = pictured(&finish).unzip();
            let specular = specular.flatten();
            look.reflection = Reflection {
                // the image of roughness of a map of reflectance has the factor in it
                roughness: match specular {
                    Some(_) => 1.0,
                    None => finish.roughness_or_usual(),
                },
                metal: finish.metal_or_usual(),
                reflectance: Some(finish.reflectance_or_usual()),
                surface: surface.map(on_texture),
                specular: specular.map(on_texture),
                normals: None,
            };
        }
        look.reflection.normals = finish.normals.as_ref().map(normals).map(on_texture);
    }
}

/// Replaces what the stages show by glass, which is frosted where its roughness is above 0.
fn make_glass(index: f32, part: Vec3, roughness: f32, look: &mut Look) {
    look.dielectric = Some(Dielectric {
        index,
        transmission: 1.0,
        liquid: None,
    });
    look.reflection = Reflection::usual(roughness);
    make_plain(part, look);
    (look.glow, look.glow_factor) = (None, Vec3::ZERO);
    look.lost.retain(|line| !line.starts_with("stage "));
}

/// A mirror in place of the colour, if it mirrors most of the light; no format here has both.
fn make_mirror(mirror: Vec3, look: &mut Look) {
    let covers = look.alpha == Alpha::Opaque && look.dielectric.is_none();
    if covers && overbright::luminance(mirror) >= LEAST_MIRROR {
        look.reflection = Reflection {
            normals: look.reflection.normals.take(),
            ..Reflection::mirror()
        };
        make_plain(mirror, look);
    } else {
        let [r, g, b] = mirror.to_array();
        look.lost
            .push(format!("mirrors {r} {g} {b} of the light; left out"));
    }
}

/// One opaque colour.
fn make_plain(color: Vec3, look: &mut Look) {
    look.color = None;
    look.factor = color.extend(1.0);
    look.alpha = Alpha::Opaque;
    (look.vertex_color, look.vertex_alpha) = (None, None);
    look.lightmapped = false;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaled_normals_have_unit_length() {
        let flat = scaled_normal([128, 128, 255], Vec2::splat(2.0));
        assert_eq!(flat, [129, 129, 255]);
        // slopes of 0.3 and -0.4, doubled
        let [x, y, z] = scaled_normal([166, 77, 239], Vec2::splat(2.0)).map(f32::from);
        assert!((x / 127.5 - 1.0 - 0.6).abs() < 0.01, "{x}");
        assert!((y / 127.5 - 1.0 + 0.8).abs() < 0.02, "{y}");
        assert!(z < 150.0, "{z}");
        // beyond unit length they lie in the surface
        assert_eq!(scaled_normal([255, 128, 128], Vec2::splat(9.0))[0], 255);
    }
}
