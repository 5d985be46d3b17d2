//! The stage whose texture reflects dynamic lights that are evaluated per pixel (`r_dlightMode`).
//!
//! Source: engine behaviour of Quake3e's `renderer` (`FindLightingStage` and `FindLightingBundle` in `tr_shader.c`).

use shaderscript::{AlphaFunc, BlendFactor, Shader, Stage, StageImage, TcGen, TcMod, sort};

use super::material::NO_DYNAMIC_LIGHT;

/// Index of the stage in the material's stages; `None` for a material that reflects no such light.
pub(super) fn light_stage(shader: &Shader, sort: f32) -> Option<usize> {
    if sort == sort::SKY || sort >= sort::FOG {
        return None;
    }
    if let Some(stated) = shader.stages.iter().position(|stage| stage.dynamic_light) {
        return Some(stated);
    }
    if shader.sky.is_some() || shader.surface_flags & NO_DYNAMIC_LIGHT != 0 {
        return None;
    }
    let mut chosen: Option<(usize, &Stage)> = None;
    let mut lightmap = None;
    for (index, stage) in shader.stages.iter().enumerate() {
        if stage.image == StageImage::Lightmap {
            // the stage before the lightmap
            if chosen.is_some_and(|(at, _)| at + 1 == index) {
                break;
            }
            lightmap = Some(index);
            continue;
        }
        if stage.tc_gen != TcGen::Base || stage.image == StageImage::White {
            continue;
        }
        if let Some((_, before)) = chosen {
            if is_cut_out(before) && is_added(stage) {
                break;
            }
            if prefers(before, stage) {
                continue;
            }
        }
        chosen = Some((index, stage));
        // the stage after the lightmap
        if lightmap.is_some_and(|at| at + 1 == index) {
            break;
        }
    }
    chosen.map(|(index, _)| index).or(lightmap)
}

/// Whether an earlier stage is better than a later one.
fn prefers(before: &Stage, stage: &Stage) -> bool {
    let detail = (BlendFactor::DstColor, BlendFactor::SrcColor);
    let glow = (BlendFactor::One, BlendFactor::SrcAlpha);
    stage.detail
        || before.image.names().len() < stage.image.names().len()
        || is_still(before) && !is_still(stage)
        || stage.blend == Some(detail) && before.blend == Some(glow)
}

/// Whether texture coordinates do not depend on time.
fn is_still(stage: &Stage) -> bool {
    let still = |m: &TcMod| matches!(m, TcMod::Scale(_) | TcMod::Transform { .. });
    stage.tc_mods.iter().all(still)
}

fn is_cut_out(stage: &Stage) -> bool {
    stage.depth_write && stage.blend.is_none() && stage.alpha_func == Some(AlphaFunc::Ge128)
}

fn is_added(stage: &Stage) -> bool {
    let added = Some((BlendFactor::One, BlendFactor::One));
    stage.blend == added && !stage.depth_write && stage.alpha_func.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(stages: &str) -> Option<usize> {
        let script = format!("a {{ {stages} }}");
        let parsed = shaderscript::parse_script("a.shader", script.as_bytes());
        let shader = parsed.shaders.first().unwrap();
        light_stage(shader, shader.sort.unwrap_or(sort::OPAQUE))
    }

    #[test]
    fn the_texture_beside_the_lightmap_reflects_light() {
        assert_eq!(chosen("{ map a.tga }"), Some(0));
        assert_eq!(chosen("{ map $lightmap }"), Some(0));
        assert_eq!(
            chosen(
                "{ map $lightmap }\n{ map a.tga\nblendFunc filter }\n{ map b.tga\nblendFunc add }"
            ),
            Some(1)
        );
        assert_eq!(
            chosen(
                "{ map a.tga }\n{ map $lightmap\nblendFunc filter }\n{ map b.tga\nblendFunc add }"
            ),
            Some(0)
        );
        assert_eq!(
            chosen(
                "{ map a.tga\ntcGen environment }\n{ map b.tga\nblendFunc blend }\n{ map $lightmap\nblendFunc filter }"
            ),
            Some(1)
        );
        // without a lightmap the last one, unless it is a detail, animated or moving
        assert_eq!(
            chosen("{ map a.tga }\n{ map b.tga\nblendFunc blend }"),
            Some(1)
        );
        assert_eq!(
            chosen("{ map a.tga }\n{ map b.tga\nblendFunc blend\ndetail }"),
            Some(0)
        );
        assert_eq!(
            chosen("{ map a.tga }\n{ map b.tga\nblendFunc blend\ntcMod scroll 1 1 }"),
            Some(0)
        );
        assert_eq!(
            chosen("{ map a.tga }\n{ animMap 2 b.tga c.tga\nblendFunc blend }"),
            Some(0)
        );
        assert_eq!(
            chosen("{ map a.tga\nalphaFunc GE128\ndepthWrite }\n{ map b.tga\nblendFunc add }"),
            Some(0)
        );
    }

    #[test]
    fn a_script_may_name_the_stage() {
        let script =
            b"a { surfaceparm nodlight\n{ map a.tga\ndlight }\n{ map b.tga\nblendFunc blend } }";
        let parsed = shaderscript::parse_script("a.shaderx", script);
        let shader = parsed.shaders.first().unwrap();
        assert_eq!(light_stage(shader, sort::OPAQUE), Some(0));
        assert_eq!(light_stage(shader, sort::BLEND), None);
    }

    #[test]
    fn skies_and_what_takes_no_light_have_no_such_stage() {
        assert_eq!(chosen("surfaceparm nodlight\n{ map a.tga }"), None);
        assert_eq!(chosen("surfaceparm sky\n{ map a.tga }"), None);
        assert_eq!(chosen("sort additive\n{ map a.tga }"), None);
        assert_eq!(chosen("{ map a.tga\ntcGen environment }"), None);
        assert_eq!(chosen(""), None);
    }
}
