//! Parts of a material: the renderer's own stages, sky sides and drawing passes.

use shaderscript::{Shader, Sky};

use super::compile;
use super::material::{Combine, RasterPass};
use super::source::{ImageFlags, ImageSource};

/// A material of one white stage, modified by `edit`.
pub(super) fn internal_shader(name: &str, edit: impl FnOnce(&mut shaderscript::Stage)) -> Shader {
    let mut stage = shaderscript::Stage::default();
    edit(&mut stage);
    let mut shader = Shader::new(name);
    shader.cull = shaderscript::Cull::None;
    shader.stages.push(stage);
    shader
}

/// The sides of a sky's far box. A missing side has the default image; without the first side there is no box.
pub(super) fn sky_faces(outer: &str, source: &mut dyn ImageSource) -> Option<[u32; 6]> {
    let flags = ImageFlags {
        mipmap: true,
        picmip: true,
        clamp: true,
        detail: false,
        data: false,
    };
    let faces = Sky::SIDES.map(|side| {
        source
            .image(&format!("{outer}_{side}.tga"), flags)
            .map(|(index, _)| index)
    });
    faces[0]?;
    let missing = source.default_image();
    Some(faces.map(|face| face.unwrap_or(missing)))
}

/// The drawing passes of the classic look.
pub(super) fn passes(shader: &Shader, stage_first: u32) -> Vec<RasterPass> {
    let index = |stage: usize| stage_first + u32::try_from(stage).unwrap_or(0);
    shaderscript::collapse(shader)
        .into_iter()
        .filter_map(|pass| {
            let stage = shader.stages.get(pass.first)?;
            let combine = match pass.combine {
                shaderscript::Combine::Add => Combine::Add,
                shaderscript::Combine::None | shaderscript::Combine::Modulate => Combine::Modulate,
            };
            Some(RasterPass {
                stages: [index(pass.first), index(pass.second.unwrap_or(pass.first))],
                stage_count: if pass.second.is_some() { 2 } else { 1 },
                combine,
                blend: pass
                    .blend
                    .map(|(src, dst)| (compile::blend_factor(src), compile::blend_factor(dst))),
                depth_write: stage.depth_write,
                depth_equal: stage.depth_func == shaderscript::DepthFunc::Equal,
                depth_test: stage.depth_func != shaderscript::DepthFunc::Disabled,
                alpha_func: compile::alpha_func(stage.alpha_func),
            })
        })
        .collect()
}
