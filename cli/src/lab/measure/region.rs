//! Similarity of pictures by region.

use anyhow::Result;
use relight::compare::{Rgb8, flip_map, ssim_map};
use serde_json::{Map, Value, json};

use crate::lab::statistics::{marked_mean, temporal_noise};

/// The reference, and the regions of its pixels.
pub struct Regions {
    truth: Rgb8,
    all: Vec<bool>,
    /// Pixels with specular paths: mirror, portal, glass, liquid or shiny surface.
    specular: Vec<bool>,
    /// All other pixels.
    direct: Vec<bool>,
}

impl Regions {
    /// `specular`: rows from the top, of the picture's size.
    pub fn new(truth: &Rgb8, specular: Vec<bool>) -> Self {
        Self {
            truth: truth.clone(),
            all: vec![true; specular.len()],
            direct: specular.iter().map(|s| !s).collect(),
            specular,
        }
    }

    /// Share of pixels with specular paths, 0 to 1.
    pub fn specular_share(&self) -> f32 {
        let count = self.specular.iter().filter(|s| **s).count();
        count as f32 / self.specular.len().max(1) as f32
    }

    /// Mask of these pixels, white on black.
    ///
    /// # Errors
    /// The mask's size differs from the picture's.
    pub fn picture(&self) -> Result<Rgb8> {
        let pixels = self.specular.iter().flat_map(|s| [u8::from(*s) * 255; 3]);
        let (width, height) = (self.truth.width(), self.truth.height());
        Ok(Rgb8::new(width, height, pixels.collect())?)
    }

    /// Similarity of pictures of a moving and of a resting camera, and noise of the latter; of all pixels, and of each
    /// region with at least a hundredth of them.
    ///
    /// # Errors
    /// The pictures differ in size, or are too small.
    pub fn compare(
        &self,
        moving: &Rgb8,
        rested: &Rgb8,
        watched: &[Vec<f32>],
    ) -> Result<Map<String, Value>> {
        let maps = [
            ssim_map(&self.truth, moving)?,
            flip_map(&self.truth, moving)?,
            ssim_map(&self.truth, rested)?,
            flip_map(&self.truth, rested)?,
        ];
        let figures = |part: &[bool]| {
            let [ssim, flip, rest_ssim, rest_flip] =
                [0, 1, 2, 3].map(|i| marked_mean(&maps[i], part));
            let mut figures = Map::new();
            figures.insert("ssim".into(), json!(ssim));
            figures.insert("flip".into(), json!(flip));
            figures.insert("rest_ssim".into(), json!(rest_ssim));
            figures.insert("rest_flip".into(), json!(rest_flip));
            figures.insert("noise".into(), json!(temporal_noise(watched, part)));
            figures
        };
        let mut result = figures(&self.all);
        let share = self.specular_share();
        for (name, part, share) in [
            ("specular", &self.specular, share),
            ("direct", &self.direct, 1.0 - share),
        ] {
            if share >= 0.01 {
                result.insert(name.into(), Value::Object(figures(part)));
            }
        }
        Ok(result)
    }
}
