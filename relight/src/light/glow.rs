//! What a stack of stages shows of its own, without any light falling on it, and what it shows of the light that does.

use super::emission::luminance;
use crate::image::Image;
use crate::overbright;
use glam::{Vec2, Vec3, Vec4};
use shaderscript::eval::{self, ColorContext};
use shaderscript::light::{LightLinear, StageSample, compose, compose_encoded, glow_stages};
use shaderscript::{Shader, Stage, StageImage, TcGen};

/// Samples per side of a texture.
const GRID: u32 = 16;

/// Brightnesses that a texture is told apart into.
const SHADES: usize = 16;

/// Times at which a material that moves is looked at, seconds: spread unevenly, so that no common period hides a
/// blinking lamp.
const TIMES: [f64; 12] = [
    0.0, 0.31, 0.73, 1.07, 1.39, 1.83, 2.21, 2.69, 3.17, 3.71, 4.33, 5.09,
];

/// One of the brightnesses of a material's texture: what it shows of the light that falls on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Part of the light that is thrown back, linear: the albedo.
    pub linear: Vec3,
    /// What the engine multiplies stored light by, as encoded for the display.
    pub encoded: Vec3,
}

/// Mean emission of a material's stages over texture and time, linear; zero for stages that only reflect.
///
/// Vertex colours of world surfaces are light, and light is what is left out here. Stages mapped by the reflected
/// view show surroundings, no light of their own; they count as black. `image` gives a picture by its name; one
/// that it does not know is black.
pub(super) fn mean_emission<'a>(
    shader: &Shader,
    image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec3 {
    if glow_stages(shader, true).is_empty() {
        return Vec3::ZERO;
    }
    mean(shader, &TIMES, image, |drawn| drawn.emission)
}

/// What a material's stages show of the light that falls on them, as they are at the start: the brightnesses of its
/// texture, from dark to bright, each standing for the same part of it.
pub(super) fn shades<'a>(
    shader: &Shader,
    mut image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec<Shade> {
    let start = TIMES.get(..1).unwrap_or_default();
    // Stages are put together as they are displayed, as the shaders do it.
    let bytes = std::array::from_fn(|byte| byte as f32 / 255.0);
    let drawn = drawn(shader, start, (&bytes, compose_encoded), &mut image);
    let mut all: Vec<Shade> = drawn
        .into_iter()
        .map(|drawn| {
            let lit = drawn.lit.max(Vec3::ZERO);
            let encoded = if lit.is_finite() { lit } else { Vec3::ZERO };
            Shade {
                linear: overbright::colour_to_linear(encoded),
                encoded,
            }
        })
        .collect();
    all.sort_by(|a, b| luminance(a.linear).total_cmp(&luminance(b.linear)));
    let mean = |group: &[Shade]| {
        let part = 1.0 / group.len().max(1) as f32;
        Shade {
            linear: group.iter().map(|s| s.linear).sum::<Vec3>() * part,
            encoded: group.iter().map(|s| s.encoded).sum::<Vec3>() * part,
        }
    };
    all.chunks(all.len().div_ceil(SHADES).max(1))
        .map(mean)
        .collect()
}

/// Mean over texture and times of a part of what is drawn.
fn mean<'a>(
    shader: &Shader,
    times: &[f64],
    image: impl FnMut(&str) -> Option<&'a Image>,
    part: impl Fn(LightLinear) -> Vec3,
) -> Vec3 {
    let table = overbright::byte_table();
    let drawn = drawn(shader, times, (&table, compose), image);
    let count = drawn.len().max(1) as f32;
    let sum: Vec3 = drawn.into_iter().map(|d| part(d).max(Vec3::ZERO)).sum();
    let mean = sum / count;
    if mean.is_finite() { mean } else { Vec3::ZERO }
}

/// Puts the stages of a stack together.
type Compose = fn(&[Stage], &[StageSample], bool) -> LightLinear;

/// What is drawn all over the texture, at some times. `table`: the numbers that bytes stand for.
fn drawn<'a>(
    shader: &Shader,
    times: &[f64],
    (table, compose): (&[f32; 256], Compose),
    mut image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec<LightLinear> {
    let stages = &shader.stages;
    let pictures: Vec<Vec<Option<&Image>>> = stages
        .iter()
        .map(|s| s.image.names().iter().map(|name| image(name)).collect())
        .collect();
    let mut drawn = Vec::with_capacity((GRID * GRID) as usize * times.len());
    let mut samples = Vec::with_capacity(stages.len());
    for &time in times {
        let context = ColorContext {
            time,
            ..ColorContext::default()
        };
        let colors: Vec<Vec4> = stages
            .iter()
            .map(|stage| {
                let [r, g, b, a] =
                    eval::vertex_color(stage, &context, Vec3::ZERO, Vec3::Z, [255; 4]);
                let linear = |byte: u8| table[usize::from(byte)];
                Vec4::new(linear(r), linear(g), linear(b), f32::from(a) / 255.0)
            })
            .collect();
        for cell in 0..GRID * GRID {
            let st =
                Vec2::new((cell % GRID) as f32 + 0.5, (cell / GRID) as f32 + 0.5) / GRID as f32;
            samples.clear();
            for ((stage, color), pictures) in stages.iter().zip(&colors).zip(&pictures) {
                let texture = texel(stage, pictures, st, time, table);
                samples.push(StageSample {
                    texture,
                    color: *color,
                });
            }
            drawn.push(compose(stages, &samples, true));
        }
    }
    drawn
}

/// What a stage's image shows at a place.
fn texel(
    stage: &Stage,
    pictures: &[Option<&Image>],
    st: Vec2,
    time: f64,
    table: &[f32; 256],
) -> Vec4 {
    if stage.tc_gen == TcGen::Environment {
        return Vec4::ZERO;
    }
    match stage.image {
        StageImage::White | StageImage::Lightmap => return Vec4::ONE,
        // A cinematic shows anything.
        StageImage::Video(_) => return Vec4::splat(0.5),
        _ => {}
    }
    let Some(picture) = pictures.get(stage.image.frame(time)).copied().flatten() else {
        return Vec4::ZERO;
    };
    let st = eval::apply_tc_mods(&stage.tc_mods, st, Vec3::ZERO, time, Vec2::ZERO);
    let clamp = matches!(stage.image, StageImage::ClampMap(_));
    picture.linear_texel(st, clamp, table)
}
