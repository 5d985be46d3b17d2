//! Transmission of a transparent material for rays, derived from its directives and the mean colours of its images.

use glam::{Vec3, Vec4};
use relight::materials::light::{self, LightLinear};
use shaders::types::{self, constants as c};
use shaderscript::Shader;
use shaderscript::surface_params::CONTENTS_SLIME;
use support::slice::{self, part, span};

use super::compile::StageArrays;
use super::flags::has_vertex_light;
use super::material::LightmapClass;
use super::source::ImageSource;

/// A material's stages with every image replaced by its mean and every wave at its maximum, without the stages that
/// imitate reflections.
fn mean_layer(
    shader: &Shader,
    class: LightmapClass,
    arrays: &StageArrays,
    stage_first: usize,
    source: &dyn ImageSource,
) -> LightLinear {
    let mut samples = light::stage_samples_white(&shader.stages);
    for (i, sample) in samples.iter_mut().enumerate() {
        let Some(stage) = slice::get(&arrays.stages, stage_first + i) else {
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

/// The `MATERIAL_*` bit of a dielectric that mirrors light.
pub fn mirrors(dielectric: &types::Dielectric) -> u32 {
    if dielectric.index > 0.0 {
        c::MATERIAL_REFLECTS
    } else {
        0
    }
}

/// Transmission of a material for rays. No directive defines a liquid's absorption: it is derived from the mean colour
/// of the stages over white, in white light, normalised to a brightest channel of 1. If the map has a fog volume of
/// this material, the fog absorbs instead ([`Materials::leave_to_fog`](super::Materials::leave_to_fog)).
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
    let dull =
        shader.content_flags & CONTENTS_SLIME != 0 && passed < light::LEAST_SLIME_TRANSMISSION;
    if dull || !passed.is_finite() {
        return types::Dielectric::default();
    }
    let liquid = light::classify(shader).liquid;
    let mut absorption = Vec3::ZERO;
    let color = mean.lit + mean.emission + mean.through;
    if liquid && color.is_finite() {
        absorption = -light::liquid_color(color).map(f32::ln) / light::LIQUID_DEPTH;
    }
    types::Dielectric {
        index: index.unwrap_or(0.0),
        ripple: if liquid {
            light::ripple_slope(shader)
        } else {
            0.0
        },
        // the light in a darkening stage already bounds its result
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
