//! Properties of materials for lighting, as `MATERIAL_*` bits.

use relight::materials::light::{self, BakedLight, SurfaceClass};
use shaders::types::constants as c;
use shaderscript::{Deform, RgbGen, Shader, Stage, StageImage};
use support::slice;

use super::material::LightmapClass;

/// Whether vertex colours are baked light on surfaces of a class.
pub(super) fn has_vertex_light(class: LightmapClass) -> bool {
    matches!(class, LightmapClass::Page | LightmapClass::Vertex)
}

/// Whether a stage is white in full light on surfaces without a lightmap: it shows the lightmap and no other light.
pub(super) fn shows_full_light(stage: &Stage) -> bool {
    let lit = matches!(
        stage.rgb_gen,
        RgbGen::LightingDiffuse | RgbGen::Vertex | RgbGen::ExactVertex
    );
    stage.image == StageImage::Lightmap && !lit
}

/// The `STAGE_*` bits of a stage that depend on its material and its index. `baked`: the baked light that it shows.
pub(super) fn stage_flags(
    shader: &Shader,
    class: LightmapClass,
    number: usize,
    baked: Option<BakedLight>,
) -> u32 {
    let Some(stage) = slice::get(&shader.stages, number) else {
        return 0;
    };
    let mut flags = baked_light_flag(baked, stage);
    if class != LightmapClass::Page && shows_full_light(stage) {
        flags |= c::STAGE_NO_LIGHTMAP;
    }
    let vertex_light = class == LightmapClass::Vertex;
    if light::is_reflection(shader, stage) {
        flags |= c::STAGE_REFLECTION;
        if light::is_gloss(shader, number, vertex_light) {
            flags |= c::STAGE_GLOSS;
        } else if light::is_haze(shader, number, vertex_light) {
            flags |= c::STAGE_HAZE;
        }
    }
    flags
}

/// The `STAGE_*` bit of a stage that shows baked light. The lightmap of a draw needs no bit.
pub(super) fn baked_light_flag(found: Option<BakedLight>, stage: &Stage) -> u32 {
    match found {
        Some(BakedLight::Style) => c::STAGE_LIGHT_STYLE,
        Some(BakedLight::Main) if stage.image != StageImage::Lightmap => c::STAGE_BAKED_LIGHT,
        _ => 0,
    }
}

/// `MATERIAL_*` bits, from the material's directives alone.
pub fn material_flags(shader: &Shader, class: LightmapClass) -> u32 {
    let found = light::classify(shader);
    let mut flags = match found.class {
        SurfaceClass::Opaque | SurfaceClass::Translucent => 0,
        SurfaceClass::CutOut => c::MATERIAL_CUT_OUT,
        SurfaceClass::Mirror | SurfaceClass::Portal => c::MATERIAL_PORTAL,
        SurfaceClass::Glass => c::MATERIAL_GLASS,
        SurfaceClass::Liquid => c::MATERIAL_LIQUID,
        SurfaceClass::Sky => c::MATERIAL_SKY,
        SurfaceClass::Fog => c::MATERIAL_FOG,
        SurfaceClass::Invisible => c::MATERIAL_INVISIBLE,
    };
    if found.liquid {
        flags |= c::MATERIAL_LIQUID;
    }
    if found.translucent {
        flags |= c::MATERIAL_TRANSLUCENT;
    }
    match shader.cull {
        shaderscript::Cull::Front => {}
        shaderscript::Cull::Back => flags |= c::MATERIAL_CULL_BACK,
        shaderscript::Cull::None => flags |= c::MATERIAL_TWO_SIDED,
    }
    // geometry that turns to the camera shows its back in mirrors
    let turns = |deform: &Deform| matches!(deform, Deform::AutoSprite | Deform::AutoSprite2);
    if shader.deforms.iter().any(turns) {
        flags |= c::MATERIAL_TWO_SIDED;
    }
    if found.passed {
        flags |= c::MATERIAL_PASSED;
    }
    if shader.polygon_offset {
        flags |= c::MATERIAL_POLYGON_OFFSET;
    }
    if has_vertex_light(class) {
        flags |= c::MATERIAL_VERTEX_LIGHT;
    }
    if (shader.stages.iter()).any(|stage| light::is_reflection(shader, stage)) {
        flags |= c::MATERIAL_REFLECTS;
    }
    flags
}
