//! A stack of stages as one picture, where all its images lie on the surface in the same way.

use super::images::load;
use crate::files::GameFiles;
use crate::image::Image;
use crate::materials::light::{LightLinear, StageSample, compose};
use crate::overbright::{self, ByteEncoder};
use glam::{Vec2, Vec3, Vec4};
use shaderscript::eval::{self, ColorContext};
use shaderscript::{AlphaGen, RgbGen, Shader, Stage, StageImage, TcGen, TcMod};
use std::num::NonZeroUsize;

/// Longest side of a picture that is made from several.
const LONGEST: u32 = 1024;

/// Which of the pictures of a stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// What reflects light, and alpha.
    Color,
    /// What is seen without light.
    Glow,
    /// What is seen under light of this brightness, sRGB-encoded.
    Shown(u8),
}

/// Stages as they are put together: those that show surroundings are left out.
pub fn without_reflections(shader: &Shader, stages: &[usize]) -> Vec<Stage> {
    let mut kept: Vec<Stage> = stages
        .iter()
        .filter_map(|&i| shader.stages.get(i).cloned())
        .collect();
    // What hides all behind it still does when the reflection under it is gone.
    let opaque = shader.stages.first().is_some_and(|s| s.blend.is_none());
    if let Some(first) = kept.first_mut().filter(|_| opaque) {
        first.blend = None;
    }
    kept
}

/// How often a stage's image fits into that of a stage with the coordinates `base`: whole times, at rest against it.
/// `None` when it moves against it or does not fit.
pub fn tiling(stage: &Stage, base: &[TcMod]) -> Option<Vec2> {
    if stage.tc_gen != TcGen::Base || matches!(stage.image, StageImage::Video(_)) {
        return None;
    }
    let rest = stage.tc_mods.strip_prefix(base)?;
    let mut factor = Vec2::ONE;
    for tc_mod in rest {
        match tc_mod {
            TcMod::Scale(scale) => factor *= *scale,
            _ => return None,
        }
    }
    // A scale before a movement scales the movement's pivot as well.
    let whole = |v: f32| v.fract() == 0.0 && (1.0..=64.0).contains(&v);
    (whole(factor.x) && whole(factor.y)).then_some(factor)
}

/// When a stage is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// Always: the mean of what changes.
    Mean,
    /// At a time, seconds.
    At(f64),
}

/// The colour that a stage multiplies its image with, white where it is light.
pub fn color_of(stage: &Stage, moment: Moment) -> Vec4 {
    const STEPS: u32 = 32;
    let period = |frequency: f32| f64::from(frequency.abs().max(1.0e-3)).recip();
    let (begin, length) = match (moment, &stage.rgb_gen, &stage.alpha_gen) {
        (Moment::At(time), ..) => (time, 0.0),
        (Moment::Mean, RgbGen::Wave(w), _) | (Moment::Mean, _, AlphaGen::Wave(w)) => {
            (0.0, period(w.frequency))
        }
        _ => (0.0, 0.0),
    };
    let steps = if length > 0.0 { STEPS } else { 1 };
    let mut sum = Vec4::ZERO;
    for step in 0..steps {
        let context = ColorContext {
            time: begin + length * f64::from(step) / f64::from(steps),
            ..ColorContext::default()
        };
        let [r, g, b, a] = eval::vertex_color(stage, &context, Vec3::ZERO, Vec3::Z, [255; 4]);
        let color = overbright::colour_to_linear(Vec3::new(
            f32::from(r) / 255.0,
            f32::from(g) / 255.0,
            f32::from(b) / 255.0,
        ));
        // 1 - vertex alpha is applied at the vertices, as vertex alpha is.
        let own = stage.alpha_gen != AlphaGen::OneMinusVertex;
        sum += color.extend(if own { f32::from(a) / 255.0 } else { 1.0 });
    }
    sum / steps as f32
}

/// [`color_of`], the mean of what changes.
pub fn mean_color(stage: &Stage) -> Vec4 {
    color_of(stage, Moment::Mean)
}

/// The mean of what a stack draws; `mean` gives the mean of an image, linear, with its alpha.
pub fn mean_of(
    stages: &[Stage],
    vertex_light: bool,
    moment: Moment,
    mean: &mut dyn FnMut(&str) -> Option<Vec4>,
) -> LightLinear {
    let samples: Vec<StageSample> = stages
        .iter()
        .map(|stage| StageSample {
            texture: match stage.image.names().first() {
                Some(name) => mean(name).unwrap_or(Vec4::ONE),
                None => Vec4::ONE,
            },
            color: color_of(stage, moment),
            ..StageSample::WHITE
        })
        .collect();
    // The test is on texels, not on their mean.
    let untested: Vec<Stage> = stages
        .iter()
        .map(|stage| Stage {
            alpha_func: None,
            ..stage.clone()
        })
        .collect();
    compose(&untested, &samples, vertex_light)
}

/// Puts stages together; `None` when one of their images is missing, or none has an image. Alpha is what hides the
/// background.
pub fn bake(files: &dyn GameFiles, shader: &Shader, stages: &[usize], part: Part) -> Option<Image> {
    let kept = without_reflections(shader, stages);
    let base = shader.stages.get(*stages.iter().find(|&&i| {
        shader
            .stages
            .get(i)
            .is_some_and(|s| !s.image.names().is_empty())
    })?)?;
    // Cut-outs keep the alpha that is tested.
    let tested = kept
        .iter()
        .position(|s| s.alpha_func.is_some() && s.depth_write);
    let mut pictures = Vec::with_capacity(kept.len());
    let (mut width, mut height) = (1, 1);
    for stage in &kept {
        let picture = match stage.image.names().first() {
            Some(name) => {
                let image = load(files, name)?.0;
                let tiles = tiling(stage, &base.tc_mods).unwrap_or(Vec2::ONE);
                width = width.max((image.width as f32 * tiles.x) as u32);
                height = height.max((image.height as f32 * tiles.y) as u32);
                Some((image, tiles))
            }
            None => None,
        };
        pictures.push((picture, mean_color(stage)));
    }
    let (width, height) = (width.min(LONGEST), height.min(LONGEST));
    let pictures: Vec<Laid> = pictures
        .into_iter()
        .map(|(picture, color)| Laid {
            picture: picture.map(|(image, tiles)| {
                let columns = places(width, tiles.x, image.width);
                let rows = places(height, tiles.y, image.height);
                (image, columns, rows)
            }),
            color,
        })
        .collect();
    let untested: Vec<Stage> = kept
        .iter()
        .enumerate()
        .map(|(i, stage)| Stage {
            alpha_func: stage.alpha_func.filter(|_| tested != Some(i)),
            ..stage.clone()
        })
        .collect();
    let baking = Baking {
        pictures,
        stages: untested,
        tested,
        part,
        table: overbright::byte_table(),
        encoder: ByteEncoder::new(),
    };
    let mut rgba = vec![0; width as usize * height as usize * 4];
    // Rows are independent of each other.
    let threads = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let band = (height as usize).div_ceil(threads).max(MIN_BAND);
    std::thread::scope(|scope| {
        let bands = rgba.chunks_mut(band * width as usize * 4);
        let mut first_rows = (0..).step_by(band).zip(bands);
        let own = first_rows.next();
        for (first, rows) in first_rows {
            let baking = &baking;
            scope.spawn(move || baking.rows(first, width, rows));
        }
        if let Some((first, rows)) = own {
            baking.rows(first, width, rows);
        }
    });
    Image::from_rgba(width, height, rgba)
}

/// Fewest rows that are worth a thread.
const MIN_BAND: usize = 64;

/// A stage's picture as it lies on what is baked.
struct Laid {
    /// With the pixel for each column and each row.
    picture: Option<(Image, Vec<u32>, Vec<u32>)>,
    color: Vec4,
}

/// Which pixel of `side` in a row lies at each of `count` places, where an image repeats `tiles` times.
fn places(count: u32, tiles: f32, side: u32) -> Vec<u32> {
    let place = |i: u32| {
        let t = ((i as f32 + 0.5) / count as f32 * tiles).rem_euclid(1.0);
        ((t * side as f32) as u32).min(side.saturating_sub(1))
    };
    (0..count).map(place).collect()
}

/// What all rows of a baked picture need.
struct Baking {
    pictures: Vec<Laid>,
    stages: Vec<Stage>,
    tested: Option<usize>,
    part: Part,
    table: [f32; 256],
    encoder: ByteEncoder,
}

impl Baking {
    /// Fills rows from the one numbered `first`.
    fn rows(&self, first: usize, width: u32, rgba: &mut [u8]) {
        let mut samples = Vec::with_capacity(self.pictures.len());
        for (y, row) in rgba.chunks_mut(width as usize * 4).enumerate() {
            for (x, out) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                samples.clear();
                samples.extend(self.pictures.iter().map(|laid| StageSample {
                    texture: self.texel(laid, x, first + y),
                    color: laid.color,
                    ..StageSample::WHITE
                }));
                *out = self.pixel(&samples);
            }
        }
    }

    fn texel(&self, laid: &Laid, x: usize, y: usize) -> Vec4 {
        let Some((image, columns, rows)) = &laid.picture else {
            return Vec4::ONE;
        };
        let at = columns.get(x).zip(rows.get(y));
        let at = at.map_or(0, |(&x, &y)| y as usize * image.width as usize + x as usize);
        let pixels = image.rgba.as_chunks::<4>().0;
        let [r, g, b, a] = pixels.get(at).copied().unwrap_or([0, 0, 0, 255]);
        let linear = |byte: u8| self.table[usize::from(byte)];
        Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
    }

    fn pixel(&self, samples: &[StageSample]) -> [u8; 4] {
        let drawn = compose(&self.stages, samples, true);
        let through = drawn.through.clamp(Vec3::ZERO, Vec3::ONE);
        let alpha = match self.tested.and_then(|i| samples.get(i)) {
            Some(sample) => sample.texture.w * sample.color.w,
            None => 1.0 - through.element_sum() / 3.0,
        };
        // Blending multiplies what is shown by alpha.
        let shown = match self.tested {
            None => alpha.max(1.0 / 255.0),
            Some(_) => 1.0,
        };
        let seen = match self.part {
            Part::Color => drawn.lit,
            Part::Glow => drawn.emission,
            Part::Shown(level) => drawn.lit * self.table[usize::from(level)] + drawn.emission,
        };
        let [r, g, b] = (seen / shown).to_array().map(|v| self.encoder.byte(v));
        [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0 + 0.5) as u8]
    }
}

/// What a repeating image shows at a place, linear.
pub fn texel(image: &Image, st: Vec2, table: &[f32; 256]) -> Vec4 {
    image.linear_texel(st, false, table)
}
