//! Which stages the engine draws together.
//!
//! Two collapses change what is seen, so a renderer that wants the engine's picture has to repeat them: joining the
//! first two stages into one multitexture pass, and the single stage of vertex lighting.

use crate::{
    shader::{Shader, sort},
    stage::{AlphaGen, BlendFactor, RgbGen, Stage, TcGen, WaveFunction},
};

/// How the two images of a pass are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Combine {
    /// There is one image.
    None,
    /// First image times second times colour, alphas likewise.
    Modulate,
    /// First image times colour plus second; alphas are multiplied.
    Add,
}

/// One drawing pass: one stage, or the first two together.
///
/// Colour, alpha test, depth test and depth write are those of stage `first`; each image keeps its own texture
/// coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Pass {
    /// Index of the (first) stage.
    pub first: usize,
    /// Index of the stage whose image is combined with it.
    pub second: Option<usize>,
    /// How.
    pub combine: Combine,
    /// Blend factors of the pass.
    pub blend: Option<(BlendFactor, BlendFactor)>,
}

/// The passes that the engine draws for a material.
///
/// Only stages 0 and 1 are ever joined. Joining is no mere optimization: the colour that both stages share (vertex,
/// wave, identityLighting ...) is then applied once, where two passes would apply it twice, and an alpha test gets
/// the product of the alphas.
pub fn collapse(shader: &Shader) -> Vec<Pass> {
    let single = |first: usize, stage: &Stage| Pass {
        first,
        second: None,
        combine: Combine::None,
        blend: stage.blend,
    };
    let mut passes = Vec::with_capacity(shader.stages.len());
    let mut rest = 0;
    if let [first, second, ..] = shader.stages.as_slice()
        && let Some((combine, blend)) = joined(first, second)
    {
        passes.push(Pass {
            first: 0,
            second: Some(1),
            combine,
            blend,
        });
        rest = 2;
    }
    passes.extend(
        shader
            .stages
            .iter()
            .enumerate()
            .skip(rest)
            .map(|(i, stage)| single(i, stage)),
    );
    passes
}

/// How two stages combine, and the blend factors of the result.
fn joined(first: &Stage, second: &Stage) -> Option<(Combine, Option<(BlendFactor, BlendFactor)>)> {
    use BlendFactor::{DstColor, One, SrcColor, Zero};
    // Two ways to write the same product.
    let modulates = |blend| blend == (DstColor, Zero) || blend == (Zero, SrcColor);
    let (combine, blend) = match (first.blend, second.blend) {
        (None, Some(b)) if modulates(b) => (Combine::Modulate, None),
        (Some(a), Some(b)) if modulates(a) && modulates(b) => {
            (Combine::Modulate, Some((DstColor, Zero)))
        }
        (None, Some((One, One))) => (Combine::Add, None),
        (Some((One, One)), Some((One, One))) => (Combine::Add, Some((One, One))),
        _ => return None,
    };
    let same_state = first.alpha_func == second.alpha_func && first.depth_func == second.depth_func;
    // Constants are not compared by the engine: the first stage's colour then counts for both.
    let same_color = match (&first.rgb_gen, &second.rgb_gen) {
        (RgbGen::Wave(a), RgbGen::Wave(b)) => a == b,
        (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
    };
    let same_alpha = match (&first.alpha_gen, &second.alpha_gen) {
        (AlphaGen::Wave(a), AlphaGen::Wave(b)) => a == b,
        (a, b) => std::mem::discriminant(a) == std::mem::discriminant(b),
    };
    let may_add = combine != Combine::Add || first.rgb_gen == RgbGen::Identity;
    (same_state && same_color && same_alpha && may_add).then_some((combine, blend))
}

/// The material as the engine draws it with `r_vertexLight 1`: one stage, never the lightmap.
///
/// `on_entity`: the surface has no lightmap index at all (models); its light then comes from the light
/// grid instead of its vertices. Materials of one stage or none are returned as they are.
pub fn collapse_vertex_light(shader: &Shader, on_entity: bool) -> Shader {
    let mut result = shader.clone();
    let [first, second, ..] = shader.stages.as_slice() else {
        return result;
    };
    let stage = if shader.sort_value() == sort::OPAQUE {
        let mut best = first;
        let mut best_rank = i32::MIN;
        for stage in &shader.stages {
            let rank = image_rank(stage);
            if rank > best_rank {
                (best, best_rank) = (stage, rank);
            }
        }
        Stage {
            // Image and coordinates of the best one in the state of the first.
            image: best.image.clone(),
            tc_gen: best.tc_gen.clone(),
            tc_mods: best.tc_mods.clone(),
            no_mipmaps: best.no_mipmaps,
            no_picmip: best.no_picmip,
            blend: None,
            depth_write: true,
            rgb_gen: if on_entity {
                RgbGen::LightingDiffuse
            } else {
                RgbGen::ExactVertex
            },
            alpha_gen: if on_entity {
                AlphaGen::Identity
            } else {
                AlphaGen::Vertex
            },
            ..first.clone()
        }
    } else {
        let mut stage = if first.is_lightmap() { second } else { first }.clone();
        let crosses = |a: WaveFunction, b: WaveFunction| {
            matches!((&stage.rgb_gen, &second.rgb_gen), (RgbGen::Wave(x), RgbGen::Wave(y))
                if x.function == a && y.function == b)
        };
        // Half of a cross-fade would leave the surface dark half of the time.
        if stage.rgb_gen == RgbGen::OneMinusEntity
            || second.rgb_gen == RgbGen::OneMinusEntity
            || crosses(WaveFunction::Sawtooth, WaveFunction::InverseSawtooth)
            || crosses(WaveFunction::InverseSawtooth, WaveFunction::Sawtooth)
        {
            stage.rgb_gen = RgbGen::IdentityLighting;
        }
        stage
    };
    // The engine decides the order before it collapses.
    result.sort = Some(shader.sort_value());
    result.stages = vec![stage];
    result
}

/// How well a stage stands for the whole material.
fn image_rank(stage: &Stage) -> i32 {
    let mut rank = 0;
    if stage.is_lightmap() {
        rank -= 100;
    }
    if stage.tc_gen != TcGen::Base {
        rank -= 5;
    }
    if !stage.tc_mods.is_empty() {
        rank -= 5;
    }
    if !matches!(stage.rgb_gen, RgbGen::Identity | RgbGen::IdentityLighting) {
        rank -= 3;
    }
    rank
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImplicitKind, StageImage, parse_script};
    use BlendFactor::{DstColor, One, Zero};

    fn shader(stages: &str) -> Shader {
        let script = parse_script("test", format!("t\n{{\n{stages}\n}}\n").as_bytes());
        assert_eq!(script.diagnostics, []);
        script.shaders.into_iter().next().unwrap()
    }

    fn shape(shader: &Shader) -> Vec<(usize, Option<usize>, Combine)> {
        collapse(shader)
            .iter()
            .map(|p| (p.first, p.second, p.combine))
            .collect()
    }

    #[test]
    fn lightmap_and_image_are_one_pass() {
        let lit = Shader::implicit("x", ImplicitKind::Lightmapped);
        assert_eq!(shape(&lit), [(0, Some(1), Combine::Modulate)]);
        // Different colours keep them apart.
        let white = Shader::implicit("x", ImplicitKind::White);
        assert_eq!(shape(&white).len(), 2);
    }

    #[test]
    fn every_pair_of_blends() {
        let alone = [(0, None, Combine::None), (1, None, Combine::None)];
        let modulate = [(0, Some(1), Combine::Modulate)];
        let add = [(0, Some(1), Combine::Add)];
        let mul = "blendFunc GL_ZERO GL_SRC_COLOR";
        for (a, b, expected) in [
            ("", "blendFunc filter", &modulate[..]),
            ("", mul, &modulate),
            ("blendFunc filter", mul, &modulate),
            (mul, mul, &modulate),
            ("", "blendFunc add", &add),
            ("blendFunc add", "blendFunc add", &add),
            ("", "", &alone),
            ("", "blendFunc blend", &alone),
            ("blendFunc filter", "blendFunc add", &alone),
            ("blendFunc add", "blendFunc filter", &alone),
        ] {
            let s = shader(&format!(
                "{{\nmap a\n{a}\nrgbGen identity\n}}\n{{\nmap b\n{b}\nrgbGen identity\n}}"
            ));
            assert_eq!(shape(&s), expected, "{a} / {b}");
        }
        let s = shader(
            "{\nmap a\nblendFunc filter\n}\n{\nmap b\nblendFunc GL_ZERO GL_SRC_COLOR\n}\n{\nmap c\nblendFunc add\n}",
        );
        let passes = collapse(&s);
        assert_eq!(passes[0].blend, Some((DstColor, Zero)));
        assert_eq!(passes[1].blend, Some((One, One)));
        assert_eq!(passes[1].first, 2);
    }

    #[test]
    fn different_state_or_color_keeps_stages_apart() {
        for (a, b) in [
            ("alphaFunc GE128", ""),
            ("", "depthFunc equal"),
            ("rgbGen vertex", "rgbGen identity"),
            ("rgbGen wave sin 0 1 0 1", "rgbGen wave sin 0 1 0 2"),
            ("alphaGen const 0.5", ""),
        ] {
            let s = shader(&format!(
                "{{\nmap a\nrgbGen identity\n{a}\n}}\n{{\nmap b\nblendFunc filter\nrgbGen identity\n{b}\n}}"
            ));
            assert_eq!(collapse(&s).len(), 2, "{a} / {b}");
        }
        // An addition needs plain colours.
        let s = shader("{\nmap a\nrgbGen vertex\n}\n{\nmap b\nblendFunc add\nrgbGen vertex\n}");
        assert_eq!(collapse(&s).len(), 2);
        let s = shader("{\nmap a\nrgbGen vertex\n}\n{\nmap b\nblendFunc filter\nrgbGen vertex\n}");
        assert_eq!(collapse(&s).len(), 1);
    }

    #[test]
    fn vertex_light_takes_the_best_image() {
        let s = shader(
            "{\nmap $lightmap\nrgbGen identity\n}\n{\nmap base\nblendFunc filter\n}\n{\nmap env\ntcGen environment\n\
             blendFunc add\n}",
        );
        let one = collapse_vertex_light(&s, false);
        assert_eq!(one.stages.len(), 1);
        assert_eq!(one.stages[0].image, StageImage::Map("base".into()));
        assert_eq!(one.stages[0].rgb_gen, RgbGen::ExactVertex);
        assert_eq!(one.stages[0].blend, None);
        assert_eq!(one.sort_value(), sort::OPAQUE);
        let entity = collapse_vertex_light(&s, true);
        assert_eq!(entity.stages[0].rgb_gen, RgbGen::LightingDiffuse);
    }

    #[test]
    fn vertex_light_of_blended_materials_takes_the_first() {
        let s = shader(
            "{\nmap a\nblendFunc add\nrgbGen wave sawtooth 0 1 0 1\n}\n{\nmap b\nblendFunc add\nrgbGen wave \
             inversesawtooth 0 1 0 1\n}",
        );
        let one = collapse_vertex_light(&s, false);
        assert_eq!(one.stages[0].image, StageImage::Map("a".into()));
        assert_eq!(one.stages[0].rgb_gen, RgbGen::IdentityLighting);
        assert_eq!(one.sort_value(), sort::BLEND);
        let s = shader(
            "{\nmap $lightmap\nblendFunc add\n}\n{\nmap b\nblendFunc add\nrgbGen wave sin 0 1 0 1\n}",
        );
        let one = collapse_vertex_light(&s, false);
        assert_eq!(one.stages[0].image, StageImage::Map("b".into()));
        assert!(matches!(one.stages[0].rgb_gen, RgbGen::Wave(_)));
    }
}
