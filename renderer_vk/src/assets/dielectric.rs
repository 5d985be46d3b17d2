//! What a material that is seen through does to rays, decided from its directives and the means of its images.

use glam::{Vec3, Vec4};
use relight::materials::light::{self, LightLinear};
use shaders::types::{self, constants as c};
use shaderscript::Shader;
use shaderscript::surface_params::CONTENTS_SLIME;
use support::slice::{part, span};

use super::compile::StageArrays;
use super::flags::has_vertex_light;
use super::material::LightmapClass;
use super::source::ImageSource;

/// A material's stages with every image replaced by its mean and every wave at its brightest, without the stages that
/// stand for reflections.
fn mean_layer(
    shader: &Shader,
    class: LightmapClass,
    arrays: &StageArrays,
    stage_first: usize,
    source: &dyn ImageSource,
) -> LightLinear {
    let mut samples = light::stage_samples_white(&shader.stages);
    for (i, sample) in samples.iter_mut().enumerate() {
        let Some(stage) = arrays.stages.get(stage_first + i) else {
            continue;
        };
        if stage.flags & c::STAGE_REFLECTION != 0 {
            sample.texture = Vec4::W;
            continue;
        }
        let images = part(&arrays.images, span(stage.image_first, stage.image_count));
        if !images.is_empty() {
            let sum: Vec4 = images.iter().map(|&image| source.mean(image)).sum();
            sample.texture = sum / images.len() as f32;
        }
    }
    light::compose(&shader.stages, &samples, has_vertex_light(class))
}

/// Distance in a liquid after which white light has the colour that its surface shows, units.
const LIQUID_DEPTH: f32 = 1024.0;
/// Slime that in the mean passes less than this is not seen through, whatever its class: it stays what its stages show.
/// Water is smooth all the same.
const LEAST_TRANSMISSION: f32 = 0.15;
/// Darkest that a liquid colours one channel over its depth.
const LEAST_COLOR: f32 = 0.05;

/// What a material does to rays that pass it. The absorption of a liquid has no directive: it is derived from the colour
/// that the stages have in the mean over white, in white light, with its brightest channel at 1. Where a map has a volume
/// of fog of it that absorbs instead ([`Materials::leave_to_fog`](super::Materials::leave_to_fog)).
pub fn dielectric(
    shader: &Shader,
    class: LightmapClass,
    arrays: &StageArrays,
    stage_first: usize,
    source: &dyn ImageSource,
) -> types::Dielectric {
    let filters = light::filters_light(shader);
    let index = light::refraction_index(shader);
    if index.is_none() && !filters {
        return types::Dielectric::default();
    }
    let mean = mean_layer(shader, class, arrays, stage_first, source);
    let passed = mean.through.max_element();
    let dull = shader.content_flags & CONTENTS_SLIME != 0 && passed < LEAST_TRANSMISSION;
    if dull || !passed.is_finite() {
        return types::Dielectric::default();
    }
    let liquid = light::classify(shader).liquid;
    let mut absorption = Vec3::ZERO;
    let color = mean.lit + mean.emission + mean.through;
    if liquid && color.is_finite() {
        let color = color / color.max_element().max(1.0e-6);
        absorption = -color
            .clamp(Vec3::splat(LEAST_COLOR), Vec3::ONE)
            .map(f32::ln)
            / LIQUID_DEPTH;
    }
    types::Dielectric {
        index: index.unwrap_or(0.0),
        ripple: if liquid {
            light::ripple_slope(shader)
        } else {
            0.0
        },
        // the light that darkens what is behind bounds it already
        scale: if light::darkens_behind(&shader.stages, has_vertex_light(class)) {
            1.0
        } else {
            1.0 / passed.max(1.0)
        },
        filters: u32::from(filters && !liquid),
        filter_color: mean.through.clamp(Vec3::ZERO, Vec3::ONE),
        absorption,
    }
}
