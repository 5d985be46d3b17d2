//! How a surface reflects, in the words of ioquake3's `opengl2` renderer.
//!
//! `stage normalMap` and `stage specularMap` make a stage of that image, which is not drawn; the other words stand in such
//! a stage or in that of the colour. Words of one meaning are read to that meaning here: `specularExponent`, `gloss`,
//! `roughness` and the last number of `specularScale` all become a gloss, whose meaning `r_glossType` selects.

use std::fmt;

use glam::{Vec2, Vec3};

use crate::token::number;

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
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NormalStage {
    /// Its name.
    pub image: String,
    /// `normalScale`: factors of its first two components.
    pub scale: Option<Vec2>,
    /// `stage normalParallaxMap`: its alpha has heights.
    pub heights: bool,
    /// `parallaxDepth`, or the third number of `normalScale`: depth of an alpha of 0, in texture coordinates.
    pub depth: Option<f32>,
}

/// What a gloss of 0 to 1 means (`r_glossType`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GlossType {
    /// 0 and other numbers: roughness is 2^(-3 gloss).
    Gloss,
    /// 1: gloss is 1 - roughness.
    #[default]
    Smoothness,
    /// 2: gloss is roughness.
    Roughness,
    /// 3: 8190 gloss is the exponent of a Blinn-Phong highlight.
    Shininess,
}

impl fmt::Display for GlossType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gloss => "gloss",
            Self::Smoothness => "smoothness",
            Self::Roughness => "roughness",
            Self::Shininess => "shininess",
        })
    }
}

impl GlossType {
    /// By the text of the engine's variable; empty: the engine has none.
    pub fn of_variable(text: &str) -> Self {
        // the engine reads its integer
        match text.trim() {
            "" => Self::default(),
            text => match number(text).trunc() {
                1.0 => Self::Smoothness,
                2.0 => Self::Roughness,
                3.0 => Self::Shininess,
                _ => Self::Gloss,
            },
        }
    }

    /// Perceptual roughness of a gloss.
    pub fn roughness(self, gloss: f32) -> f32 {
        match self {
            Self::Gloss => (-3.0 * gloss).exp2(),
            Self::Smoothness => 1.0 - gloss,
            Self::Roughness => gloss,
            Self::Shininess => roughness_of_exponent(MOST_SHINY * gloss),
        }
    }

    /// The gloss of a perceptual roughness.
    pub fn gloss(self, roughness: f32) -> f32 {
        match self {
            Self::Gloss => (-roughness.log2() / 3.0).min(1.0),
            Self::Smoothness => 1.0 - roughness,
            Self::Roughness => roughness,
            Self::Shininess => ((2.0 / roughness.powi(4) - 2.0) / MOST_SHINY).min(1.0),
        }
    }
}

/// Exponent of a gloss of 1, of [`GlossType::Shininess`].
const MOST_SHINY: f32 = 8190.0;

/// Specular reflection. What is `None` is not stated.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpecularStage {
    /// `stage specularMap`: its image.
    pub image: Option<String>,
    /// The channels of the image are gloss (red) and metal (green), as with `r_pbr 1`; otherwise they are the colour of
    /// the reflection and the gloss (alpha).
    pub metallic: bool,
    /// Reflectance at normal incidence; a factor of the image's.
    pub reflectance: Option<Vec3>,
    /// Part that is metal, with `r_pbr 1`; a factor of the image's.
    pub metal: Option<f32>,
    /// As [`GlossType`] says, by default 1 - perceptual roughness; a factor of the image's.
    pub gloss: Option<f32>,
}

impl SpecularStage {
    pub(crate) fn is_empty(&self) -> bool {
        let SpecularStage {
            image,
            metallic: _,
            reflectance,
            metal,
            gloss,
        } = self;
        image.is_none() && reflectance.is_none() && metal.is_none() && gloss.is_none()
    }
}

/// Perceptual roughness of a Blinn-Phong exponent: the width of the GGX distribution that has the same peak is the fourth
/// root of 2 / (exponent + 2) (`opengl2`, `tr_shader.c`).
pub(crate) fn roughness_of_exponent(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25)
}
