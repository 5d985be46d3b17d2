//! How a surface reflects, in the words of ioquake3's `opengl2` renderer.
//!
//! `stage normalMap` and `stage specularMap` make a stage of that image, which is not drawn; the other words stand in such
//! a stage or in that of the colour. Words of one meaning are read to that meaning here: `specularExponent`, `gloss`,
//! `roughness` and the last number of `specularScale` all become a smoothness.

use glam::{Vec2, Vec3};

/// What a definition states about its reflection.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reflection {
    /// `stage normalMap` or `normalParallaxMap`: the first after the first stage of colour.
    pub normals: Option<NormalStage>,
    /// `stage specularMap`, the first after the first stage of colour; without one, what that stage of colour states.
    pub specular: Option<SpecularStage>,
}

impl Reflection {
    /// Whether nothing is stated.
    pub fn is_empty(&self) -> bool {
        self.normals.is_none() && self.specular.is_none()
    }
}

/// A normal map.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NormalStage {
    /// Its name.
    pub image: String,
    /// `normalScale`: factors of its first two components.
    pub scale: Vec2,
}

/// Specular reflection. What is `None` is not stated.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpecularStage {
    /// `stage specularMap`: its image.
    pub image: Option<String>,
    /// The channels of the image are smoothness (red) and metal (green), as with `r_pbr 1`; otherwise they are the colour
    /// of the reflection and the smoothness (alpha).
    pub metallic: bool,
    /// Reflectance at normal incidence; a factor of the image's.
    pub reflectance: Option<Vec3>,
    /// Part that is metal, with `r_pbr 1`; a factor of the image's.
    pub metal: Option<f32>,
    /// 1 - perceptual roughness; a factor of the image's.
    pub smoothness: Option<f32>,
}

impl SpecularStage {
    pub(crate) fn is_empty(&self) -> bool {
        let SpecularStage {
            image,
            metallic: _,
            reflectance,
            metal,
            smoothness,
        } = self;
        image.is_none() && reflectance.is_none() && metal.is_none() && smoothness.is_none()
    }
}

/// Smoothness of a Blinn-Phong exponent: the width of the GGX distribution that has the same peak is the fourth root of
/// 2 / (exponent + 2), as a perceptual roughness (`opengl2`, `tr_shader.c`).
pub(crate) fn smoothness_of_exponent(exponent: f32) -> f32 {
    1.0 - (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
}
