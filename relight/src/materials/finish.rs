//! How a material reflects: what packs and files state, which the engine's scripts cannot.

use std::fmt;

use glam::{Vec2, Vec3};
use shaderscript::GlossType;

use crate::files::GameFiles;
use crate::image::{self, Image, ImageError};

/// Reflectance at normal incidence of most materials that are no metal: an index of refraction of 1.5.
pub const USUAL_REFLECTANCE: f32 = 0.04;
/// Roughness of metal that nothing else states.
const USUAL_METAL_ROUGHNESS: f32 = 0.3;

/// Least part of blue over red and green in the mean of a normal map: its normals mostly point away from the surface.
const LEAST_BLUE: f32 = 1.1;

/// Why an image that is stated is not used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MapFault {
    /// The image of roughness, metal or reflectance cannot be loaded.
    #[error("the map of roughness {0} is missing or unreadable; the surface stays without it")]
    NoSurface(SurfaceMap),
    /// The normal map cannot be loaded.
    #[error("the normal map {0} is missing or unreadable; the surface stays without it")]
    NoNormals(String),
    /// The emissive map cannot be loaded.
    #[error("the emissive map {0} is missing or unreadable; the surface stays without it")]
    NoGlow(String),
    /// The image is something else. One of a single channel is grey.
    #[error("{0} is no normal map: its mean colour is not blue; the surface stays without it")]
    NotNormals(String),
    /// The alpha of the normal map, which should have heights, is missing or 1 everywhere.
    #[error("{0} has no heights: its alpha is missing or full; the surface stays flat")]
    NoHeights(String),
}

/// What is stated about a material. What is `None` is as without.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Finish {
    /// Perceptual roughness, 0 to 1; a factor of that of `surface`.
    pub roughness: Option<f32>,
    /// Reflectance at normal incidence of the part that is no metal, linear; a factor of that of `surface`.
    pub reflectance: Option<Vec3>,
    /// Part that is metal, 0 to 1; a factor of that of `surface`.
    pub metal: Option<f32>,
    /// Part of the light that is mirrored sharply, linear.
    pub mirror: Option<Vec3>,
    /// Refractive index, and the part of the light that passes, linear.
    pub glass: Option<(f32, Vec3)>,
    /// Value and colour of emitted light; the largest channel of the colour is 1.
    pub emission: Option<(f32, Vec3)>,
    /// Emissive map.
    pub glow: Option<Glow>,
    /// Normal map.
    pub normals: Option<NormalMap>,
    /// Image of roughness, metal or reflectance.
    pub surface: Option<SurfaceMap>,
    /// Nothing is reflected but what is stated here.
    pub plain: bool,
}

/// An emissive map: the colour that each point of a surface emits, display-encoded.
#[derive(Debug, Clone, PartialEq)]
pub struct Glow {
    /// Its name.
    pub image: String,
    /// Radiance of its white, in units of display white.
    pub radiance: f32,
    /// The surface is a lamp of the image's mean; otherwise its light is that which the map has.
    pub lights: bool,
}

/// An image of normals in tangent space: x to the right of the image, y up, as in OpenGL.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMap {
    /// Its name.
    pub image: String,
    /// Factors of the first two components; the third completes them to unit length.
    pub scale: Vec2,
    /// Depth of an alpha of 0 below one of 1, in texture coordinates; 0: the alpha has no heights.
    pub depth: f32,
}

impl NormalMap {
    /// An image of normals whose y points down the image, as in Direct3D: `opengl2` and Quake II RTX apply it along the
    /// texture coordinate t, which grows downwards.
    pub fn downward(image: String, scale: Vec2, depth: f32) -> Self {
        NormalMap {
            image,
            scale: Vec2::new(scale.x, -scale.y),
            depth,
        }
    }
}

impl Finish {
    /// Whether the surface reflects by its roughness.
    pub fn is_rough(&self) -> bool {
        self.roughness.is_some() || self.metal.is_some() || self.surface.is_some()
    }

    /// The roughness: as stated, or that of the usual metal, or such that a map decides alone.
    pub fn roughness_or_usual(&self) -> f32 {
        let usual = match &self.surface {
            Some(map) if map.is_specular() => 0.0,
            Some(_) => 1.0,
            None => USUAL_METAL_ROUGHNESS,
        };
        self.roughness.unwrap_or(usual)
    }

    /// The reflectance of the part that is no metal.
    pub fn reflectance_or_usual(&self) -> Vec3 {
        let usual = match &self.surface {
            Some(map) if map.is_specular() => 1.0,
            _ => USUAL_REFLECTANCE,
        };
        self.reflectance.unwrap_or(Vec3::splat(usual))
    }

    /// The part that is metal.
    pub fn metal_or_usual(&self) -> f32 {
        let usual = match &self.surface {
            Some(map) if !map.is_specular() => 1.0,
            _ => 0.0,
        };
        self.metal.unwrap_or(usual)
    }

    /// Leaves out the map of roughness, metal or reflectance. The numbers of a pack go with it, because they are factors
    /// of the map; those of lines by hand have a meaning of their own.
    pub fn without_surface(&self) -> Finish {
        let mut finish = self.clone();
        match finish.surface.take() {
            None | Some(SurfaceMap::RoughnessMetal(_)) => {}
            Some(_) => finish.forget_gloss(),
        }
        finish
    }

    /// Leaves out the map of roughness, metal or reflectance if it is not `found`.
    ///
    /// # Errors
    /// It was left out.
    pub fn check_surface(&mut self, found: bool) -> Result<(), MapFault> {
        match self.surface.clone().filter(|_| !found) {
            Some(map) => {
                *self = self.without_surface();
                Err(MapFault::NoSurface(map))
            }
            None => Ok(()),
        }
    }

    /// Leaves out the normal map if it is none. `mean`: its mean colour, linear; `None` if it cannot be loaded.
    ///
    /// # Errors
    /// It was left out.
    pub fn check_normals(&mut self, mean: Option<Vec3>) -> Result<(), MapFault> {
        let is_normal_map = |mean: Vec3| mean.z > LEAST_BLUE * mean.x.max(mean.y);
        if mean.is_some_and(is_normal_map) {
            return Ok(());
        }
        match self.normals.take() {
            Some(map) if mean.is_some() => Err(MapFault::NotNormals(map.image)),
            Some(map) => Err(MapFault::NoNormals(map.image)),
            None => Ok(()),
        }
    }

    /// Leaves out the heights of the normal map if it has none. `alpha`: mean of its alpha.
    ///
    /// # Errors
    /// They were left out.
    pub fn check_heights(&mut self, alpha: Option<f32>) -> Result<(), MapFault> {
        // of 8 bits, with what averaging may lose
        const FULL: f32 = 1.0 - 0.1 / 255.0;
        match &mut self.normals {
            Some(map) if map.depth != 0.0 && alpha.is_some_and(|mean| mean >= FULL) => {
                map.depth = 0.0;
                Err(MapFault::NoHeights(map.image.clone()))
            }
            _ => Ok(()),
        }
    }

    /// Forgets roughness, metal and reflectance: the numbers are factors of the map.
    pub(super) fn forget_gloss(&mut self) {
        (self.roughness, self.reflectance, self.metal, self.surface) = (None, None, None, None);
    }

    /// What another states replaces what this one states.
    pub(super) fn overlay(&mut self, other: &Finish) {
        let Finish {
            roughness,
            reflectance,
            metal,
            mirror,
            glass,
            emission,
            glow,
            normals,
            surface,
            plain,
        } = other.clone();
        if other.is_rough() {
            self.forget_gloss();
        }
        self.roughness = roughness.or(self.roughness);
        self.reflectance = reflectance.or(self.reflectance);
        self.metal = metal.or(self.metal);
        self.mirror = mirror.or(self.mirror);
        self.glass = glass.or(self.glass);
        self.emission = emission.or(self.emission);
        self.glow = glow.or_else(|| self.glow.take());
        self.normals = normals.or_else(|| self.normals.take());
        self.surface = surface.or_else(|| self.surface.take());
        self.plain |= plain;
    }
}

/// Images that vary roughness, metal or reflectance over a surface, in the layouts that are in use.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum SurfaceMap {
    /// Roughness in green and metal in blue, as in glTF.
    RoughnessMetal(String),
    /// Gloss in red and metal in green: `specularMap` of `opengl2` with `r_pbr 1`.
    GlossMetal {
        /// The image.
        image: String,
        /// Factor of its gloss, in 255ths.
        scale: u8,
        /// What a gloss means.
        gloss_type: GlossType,
    },
    /// Colour of the reflection, display-encoded, and smoothness in alpha: `specularMap` of `opengl2`.
    Specular(String),
    /// The same with a gloss of another meaning in alpha (`r_glossType`).
    Gloss {
        /// The image.
        image: String,
        /// Factor of its gloss, in 255ths.
        scale: u8,
        /// What a gloss means.
        gloss_type: GlossType,
    },
    /// Roughness and metal in the alpha of two images: `.mat` files of Quake II RTX.
    Alphas {
        /// Image with roughness in its alpha; 1 without.
        roughness: Option<String>,
        /// Image with metal in its alpha.
        metal: String,
    },
}

impl fmt::Display for SurfaceMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SurfaceMap::RoughnessMetal(image) => write!(f, "{image}"),
            SurfaceMap::GlossMetal {
                image,
                scale: 255,
                gloss_type,
            } => write!(f, "{image} ({gloss_type} and metal)"),
            SurfaceMap::GlossMetal {
                image,
                scale,
                gloss_type,
            } => write!(f, "{image} ({gloss_type} times {scale}/255, and metal)"),
            SurfaceMap::Specular(image) => write!(f, "{image} (reflectance and smoothness)"),
            SurfaceMap::Gloss {
                image,
                scale,
                gloss_type,
            } => write!(
                f,
                "{image} (reflectance and {gloss_type} times {scale}/255)"
            ),
            SurfaceMap::Alphas {
                roughness: None,
                metal,
            } => write!(f, "{metal} (alpha)"),
            SurfaceMap::Alphas {
                roughness: Some(image),
                metal,
            } => write!(f, "{metal} and {image} (alpha)"),
        }
    }
}

impl SurfaceMap {
    /// Whether [`load`](Self::load) returns reflectance and smoothness, not roughness and metal.
    pub fn is_specular(&self) -> bool {
        matches!(self, SurfaceMap::Specular(_) | SurfaceMap::Gloss { .. })
    }

    /// The name of its image; of two images, that of metal.
    pub fn image(&self) -> &str {
        match self {
            SurfaceMap::RoughnessMetal(image)
            | SurfaceMap::GlossMetal { image, .. }
            | SurfaceMap::Specular(image)
            | SurfaceMap::Gloss { image, .. }
            | SurfaceMap::Alphas { metal: image, .. } => image,
        }
    }

    /// Loads it in one of two layouts: roughness in green and metal in blue, or, if it [is](Self::is_specular) specular,
    /// reflectance, display-encoded, with smoothness in alpha. `None` if an image of it is missing.
    ///
    /// # Errors
    /// An image cannot be read.
    pub fn load(&self, files: &dyn GameFiles) -> Result<Option<Image>, ImageError> {
        let image = |name: &str| Ok::<_, ImageError>(image::load(files, name)?.map(|(i, _)| i));
        let each = |mut image: Image, texel: &dyn Fn([u8; 4]) -> [u8; 4]| {
            for pixel in image.rgba.as_chunks_mut().0 {
                *pixel = texel(*pixel);
            }
            image
        };
        Ok(match self {
            SurfaceMap::RoughnessMetal(name) | SurfaceMap::Specular(name) => image(name)?,
            SurfaceMap::GlossMetal {
                image: name,
                scale,
                gloss_type,
            } => {
                let rough = |gloss: u8| roughness(*gloss_type, gloss, *scale);
                image(name)?.map(|i| each(i, &|[r, g, _, _]| [255, rough(r), g, 255]))
            }
            SurfaceMap::Gloss {
                image: name,
                scale,
                gloss_type,
            } => {
                let smooth = |gloss: u8| 255 - roughness(*gloss_type, gloss, *scale);
                image(name)?.map(|i| each(i, &|[r, g, b, a]| [r, g, b, smooth(a)]))
            }
            SurfaceMap::Alphas { roughness, metal } => {
                let metal = image(metal)?;
                let rough = match roughness {
                    Some(name) => image(name)?,
                    None => Some(Image::uniform([255; 4])),
                };
                metal
                    .zip(rough)
                    .map(|(metal, rough)| of_alphas(&rough, &metal))
            }
        })
    }
}

/// Roughness of a texel's gloss times a factor in 255ths, of 255.
fn roughness(gloss_type: GlossType, gloss: u8, scale: u8) -> u8 {
    let gloss = f32::from(gloss) * f32::from(scale) / (255.0 * 255.0);
    // the cast clamps
    (gloss_type.roughness(gloss) * 255.0).round() as u8
}

/// Roughness (green) and metal (blue) from the alpha of two images, in the larger one's size.
fn of_alphas(roughness: &Image, metal: &Image) -> Image {
    let (width, height) = (
        roughness.width.max(metal.width),
        roughness.height.max(metal.height),
    );
    let alpha = |image: &Image, x: u32, y: u32| {
        let at =
            |k: u32, side: u32, of: u32| (u64::from(k) * u64::from(side) / u64::from(of)) as usize;
        let index = at(y, image.height, height) * image.width as usize + at(x, image.width, width);
        (image.rgba.as_chunks::<4>().0.get(index)).map_or(255, |[_, _, _, a]| *a)
    };
    let mut out = Image::uniform([255; 4]);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let rgba = pixels.flat_map(|(x, y)| [255, alpha(roughness, x, y), alpha(metal, x, y), 255]);
    if let Some(image) = Image::from_rgba(width, height, rgba.collect()) {
        out = image;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    /// A TGA of 32 bits with these pixels (RGBA), in one row.
    fn tga(pixels: &[[u8; 4]]) -> Vec<u8> {
        let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        bytes.extend((pixels.len() as u16).to_le_bytes());
        bytes.extend([1, 0, 32, 8]);
        bytes.extend(pixels.iter().flat_map(|&[r, g, b, a]| [b, g, r, a]));
        bytes
    }

    #[test]
    fn layouts_become_two() {
        let mut files = MemoryFiles::new();
        files.insert("a.tga", tga(&[[10, 20, 30, 40]])).unwrap();
        files
            .insert("b.tga", tga(&[[0, 0, 0, 1], [0, 0, 0, 2]]))
            .unwrap();
        let load = |map: SurfaceMap| map.load(&files).unwrap().map(|image| image.rgba);
        let name = || "a.tga".to_owned();
        let stored = Some(vec![10, 20, 30, 40]);
        assert_eq!(load(SurfaceMap::RoughnessMetal(name())), stored);
        assert_eq!(load(SurfaceMap::Specular(name())), stored);
        for (scale, rough) in [(255, 245), (51, 253)] {
            let image = name();
            let gloss_type = GlossType::Smoothness;
            let smooth = load(SurfaceMap::GlossMetal {
                image,
                scale,
                gloss_type,
            });
            assert_eq!(smooth, Some(vec![255, rough, 20, 255]));
        }
        // an alpha of 40, and of 20
        for (gloss_type, scale, smooth) in [
            (GlossType::Gloss, 255, 71),
            (GlossType::Roughness, 255, 215),
            (GlossType::Roughness, 128, 235),
            (GlossType::Shininess, 255, 204),
        ] {
            let map = SurfaceMap::Gloss {
                image: name(),
                scale,
                gloss_type,
            };
            assert_eq!(load(map), Some(vec![10, 20, 30, smooth]), "{gloss_type}");
        }
        let alphas = |roughness: Option<&str>, metal: &str| SurfaceMap::Alphas {
            roughness: roughness.map(str::to_owned),
            metal: metal.to_owned(),
        };
        assert_eq!(load(alphas(None, "a")), Some(vec![255, 255, 40, 255]));
        // the smaller image is stretched
        let both = load(alphas(Some("a"), "b"));
        assert_eq!(both, Some(vec![255, 40, 1, 255, 255, 40, 2, 255]));
        assert_eq!(load(alphas(Some("none"), "b")), None);
        assert_eq!(load(SurfaceMap::Specular("none".to_owned())), None);
    }

    #[test]
    fn unusable_images_are_left_out() {
        let of_map = |surface| Finish {
            roughness: Some(0.5),
            surface: Some(surface),
            ..Finish::default()
        };
        let checked = |mut finish: Finish, found| {
            let fault = finish.check_surface(found);
            (finish, fault)
        };
        let specular = SurfaceMap::Specular("a_s".to_owned());
        let found = checked(of_map(specular.clone()), true);
        assert_eq!(found, (of_map(specular.clone()), Ok(())));
        let fault = Err(MapFault::NoSurface(specular.clone()));
        assert_eq!(checked(of_map(specular), false), (Finish::default(), fault));
        let (rough, _) = checked(of_map(SurfaceMap::RoughnessMetal("a_r".to_owned())), false);
        assert_eq!((rough.roughness, rough.metal_or_usual()), (Some(0.5), 0.0));
        let normals = |mean| {
            let mut finish = Finish {
                normals: Some(NormalMap {
                    image: "a_n".to_owned(),
                    scale: Vec2::ONE,
                    depth: 0.0,
                }),
                ..Finish::default()
            };
            let fault = finish.check_normals(mean);
            (finish.normals.is_some(), fault)
        };
        let name = || "a_n".to_owned();
        let blue = Vec3::new(0.2, 0.2, 1.0);
        assert_eq!(normals(Some(blue)), (true, Ok(())));
        let grey = Err(MapFault::NotNormals(name()));
        assert_eq!(normals(Some(Vec3::ONE)), (false, grey));
        assert_eq!(normals(None), (false, Err(MapFault::NoNormals(name()))));
    }

    #[test]
    fn what_is_not_stated_leaves_maps_alone() {
        let of = |surface| Finish {
            surface,
            ..Finish::default()
        };
        let values = |f: Finish| {
            (
                f.roughness_or_usual(),
                f.reflectance_or_usual().x,
                f.metal_or_usual(),
            )
        };
        assert_eq!(values(of(None)), (USUAL_METAL_ROUGHNESS, 0.04, 0.0));
        let specular = SurfaceMap::Specular(String::new());
        assert_eq!(values(of(Some(specular))), (0.0, 1.0, 0.0));
        let metal = SurfaceMap::RoughnessMetal(String::new());
        assert_eq!(values(of(Some(metal))), (1.0, 0.04, 1.0));
    }
}
