//! The mean light that a stack of stages shows of its own, without any light falling on it.

use crate::image::Image;
use crate::overbright;
use glam::{Vec2, Vec3, Vec4};
use shaderscript::eval::{self, ColorContext};
use shaderscript::light::{LightLinear, StageSample, compose, glow_stages};
use shaderscript::{Shader, Stage, StageImage, TcGen};

/// Samples per side of a texture.
const GRID: u32 = 16;

/// Times at which a material that moves is looked at, seconds: spread unevenly, so that no common period hides a
/// blinking lamp.
const TIMES: [f64; 12] = [
    0.0, 0.31, 0.73, 1.07, 1.39, 1.83, 2.21, 2.69, 3.17, 3.71, 4.33, 5.09,
];

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

/// Mean diffuse albedo of a material's stages over texture, linear, as they are at the start: what they show of the
/// light that falls on them.
pub(super) fn mean_albedo<'a>(
    shader: &Shader,
    image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec3 {
    let start = TIMES.get(..1).unwrap_or_default();
    mean(shader, start, image, |drawn| drawn.lit).min(Vec3::ONE)
}

/// Mean over texture and times of a part of what is drawn.
fn mean<'a>(
    shader: &Shader,
    times: &[f64],
    mut image: impl FnMut(&str) -> Option<&'a Image>,
    part: impl Fn(LightLinear) -> Vec3,
) -> Vec3 {
    let stages = &shader.stages;
    let pictures: Vec<Vec<Option<&Image>>> = stages
        .iter()
        .map(|s| s.image.names().iter().map(|name| image(name)).collect())
        .collect();
    let table = overbright::byte_table();
    let mut sum = Vec3::ZERO;
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
                let texture = texel(stage, pictures, st, time, &table);
                samples.push(StageSample {
                    texture,
                    color: *color,
                });
            }
            sum += part(compose(stages, &samples, true)).max(Vec3::ZERO);
        }
    }
    let mean = sum / (GRID * GRID * times.len() as u32) as f32;
    if mean.is_finite() { mean } else { Vec3::ZERO }
}

/// What a stage's image shows at a place, linear.
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
