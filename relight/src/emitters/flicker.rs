//! Change of lights over time: emission of a material's stages at a time, relative to its mean.

use crate::image::Image;
use crate::materials::light::{StageSample, compose};
use crate::overbright;
use crate::overbright::luminance;
use glam::{Vec3, Vec4};
use shaderscript::eval::{self, ColorContext};
use shaderscript::{AlphaGen, RgbGen, Shader, Stage, StageImage};

/// Cells along each side of the texture in which brightness is evaluated.
const GRID: u32 = 4;

/// Number and spacing, seconds, of the times of the mean: no common period hides a blinking lamp.
const TIMES: u32 = 128;
const TIME_STEP: f64 = 0.137;

/// Relative change that is ignored as invisible.
const STEADY: f32 = 0.02;

/// Largest brightness relative to the mean: a lamp that rarely flashes would be unbounded.
const MOST: f32 = 64.0;

/// Change over time of an emitting material.
#[derive(Debug, Clone, PartialEq)]
pub struct Flicker {
    stages: Vec<Stage>,
    /// For each place of the texture, each stage, each frame of its animation: what the image shows, linear.
    texels: Vec<Vec<Vec<Vec4>>>,
    /// Luminance of what the stages show, mean over time.
    mean: f32,
}

/// Whether a stage depends on time.
pub(crate) fn changes(stage: &Stage) -> bool {
    stage.image.names().len() > 1
        || matches!(stage.rgb_gen, RgbGen::Wave(_))
        || matches!(stage.alpha_gen, AlphaGen::Wave(_))
}

impl Flicker {
    /// Change over time of a material; `None` if it is constant. `image` returns a picture by name.
    pub(crate) fn of<'a>(
        shader: &Shader,
        mut image: impl FnMut(&str) -> Option<&'a Image>,
    ) -> Option<Self> {
        if !shader.stages.iter().any(changes) {
            return None;
        }
        let cells = (0..GRID * GRID).map(|cell| {
            let (x, y) = (cell % GRID, cell / GRID);
            let stages = shader.stages.iter().map(|stage| match stage.image {
                StageImage::White | StageImage::Lightmap => vec![Vec4::ONE],
                StageImage::Video(_) => vec![Vec4::splat(0.5)],
                _ => {
                    let names = stage.image.names().iter();
                    names.map(|n| mean_of_cell(image(n), x, y)).collect()
                }
            });
            stages.collect()
        });
        let mut flicker = Self {
            texels: cells.collect(),
            stages: shader.stages.clone(),
            mean: 1.0,
        };
        let shown: Vec<f32> = (0..TIMES)
            .map(|i| flicker.scale(f64::from(i) * TIME_STEP))
            .collect();
        let mean = shown.iter().sum::<f32>() / TIMES as f32;
        let steady = shown.iter().all(|s| (s - mean).abs() <= mean * STEADY);
        if steady || !mean.is_finite() || mean < 1.0e-4 {
            return None;
        }
        flicker.mean = mean;
        Some(flicker)
    }

    /// Brightness at a shader time in seconds, relative to the mean. At least 0.
    pub fn scale(&self, time: f64) -> f32 {
        let context = ColorContext {
            time,
            ..ColorContext::default()
        };
        let colors: Vec<(Vec4, usize)> = self
            .stages
            .iter()
            .map(|stage| {
                let [r, g, b, a] =
                    eval::vertex_color(stage, &context, Vec3::ZERO, Vec3::Z, [255; 4]);
                let linear = |byte: u8| overbright::to_linear(f32::from(byte) / 255.0);
                let color = Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0);
                (color, stage.image.frame(time))
            })
            .collect();
        let mut sum = Vec3::ZERO;
        let mut samples = Vec::with_capacity(self.stages.len());
        for cell in &self.texels {
            samples.clear();
            samples.extend(cell.iter().zip(&colors).map(|(frames, (color, frame))| {
                let texture = frames.get(*frame).copied().unwrap_or(Vec4::ZERO);
                StageSample {
                    texture,
                    color: *color,
                    ..StageSample::WHITE
                }
            }));
            sum += compose(&self.stages, &samples, true)
                .emission
                .max(Vec3::ZERO);
        }
        let shown = luminance(sum) / self.texels.len().max(1) as f32;
        let scale = shown / self.mean;
        if scale.is_finite() {
            scale.clamp(0.0, MOST)
        } else {
            1.0
        }
    }
}

/// Mean of a cell of a picture, linear; black without one.
fn mean_of_cell(picture: Option<&Image>, x: u32, y: u32) -> Vec4 {
    let Some(picture) = picture else {
        return Vec4::ZERO;
    };
    let table = overbright::byte_table();
    let range = |cell: u32, side: u32| {
        let first = cell * side / GRID;
        first..((cell + 1) * side / GRID).max(first + 1).min(side)
    };
    let texels = picture.rgba.as_chunks::<4>().0;
    let mut sum = Vec4::ZERO;
    let mut count = 0.0f32;
    for row in range(y, picture.height) {
        for column in range(x, picture.width) {
            let at = row as usize * picture.width as usize + column as usize;
            if let Some(&[r, g, b, a]) = texels.get(at) {
                let linear = |byte: u8| table[usize::from(byte)];
                sum += Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0);
                count += 1.0;
            }
        }
    }
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shader(stages: &str) -> Shader {
        let library = shaderscript::Library::new([("t", format!("a\n{{\n{stages}\n}}\n"))]);
        library.find("a").expect("parsed").clone()
    }

    fn grey(byte: u8) -> Image {
        Image {
            width: 8,
            height: 8,
            rgba: [byte, byte, byte, 255].repeat(64),
            has_alpha: false,
        }
    }

    #[test]
    fn waves_and_animations_flicker_about_their_mean() {
        let (dark, bright) = (grey(0), grey(255));
        let image = |name: &str| Some(if name == "dark" { &dark } else { &bright });
        // on for half of each second
        let square = shader("{\nmap bright\nrgbGen wave square 0.5 0.5 0 1\n}");
        let flicker = Flicker::of(&square, image).expect("flickers");
        assert!((flicker.scale(0.25) - 2.0).abs() < 0.1);
        assert_eq!(flicker.scale(0.75), 0.0);
        // one frame of four is bright
        let animation = shader("{\nanimMap 4 dark dark bright dark\n}");
        let flicker = Flicker::of(&animation, image).expect("flickers");
        assert!(
            (flicker.scale(0.6) - 4.0).abs() < 0.3,
            "{}",
            flicker.scale(0.6)
        );
        assert_eq!(flicker.scale(0.1), 0.0);
        // nothing changes, or nothing that shows
        for still in [
            "{\nmap bright\n}",
            "{\nanimMap 4 bright bright\n}",
            "{\nmap dark\nrgbGen wave sin 0.5 0.5 0 1\n}",
        ] {
            assert_eq!(Flicker::of(&shader(still), image), None, "{still}");
        }
    }
}
