//! Materials that no script defines: what the engine makes of a bare image.

use crate::{
    shader::Shader,
    stage::{AlphaGen, BlendFactor, DepthFunc, RgbGen, Stage, StageImage, TcGen},
};

/// Where an image without a script is used; decides how it is lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ImplicitKind {
    /// On a model: lit by the light grid.
    EntityLit,
    /// On a world surface of a map shown at full brightness.
    White,
    /// On a world surface that carries light in its vertices.
    Vertex,
    /// In the overlay: vertex colour and alpha, blended, no depth test.
    TwoD,
    /// On a world surface with a lightmap.
    Lightmapped,
}

impl Shader {
    /// The material that the engine makes when no script defines `name` and an image of that name exists.
    pub fn implicit(name: &str, kind: ImplicitKind) -> Shader {
        Shader::from_image(name, StageImage::Map(name.to_owned()), kind)
    }

    /// As [`implicit`](Self::implicit) for images that the game wants clamped, without mipmaps and at full size
    /// (`RegisterShaderNoMip`).
    pub fn implicit_no_mip(name: &str, kind: ImplicitKind) -> Shader {
        let mut shader = Shader::from_image(name, StageImage::ClampMap(name.to_owned()), kind);
        shader.no_mipmaps = true;
        shader.no_picmip = true;
        for stage in &mut shader.stages {
            stage.no_mipmaps = true;
            stage.no_picmip = true;
        }
        shader
    }

    /// The material drawn where a script is rejected or an image is missing: the engine's built-in grid image,
    /// `*default`.
    pub fn default_material(name: &str) -> Shader {
        let mut shader = Shader::new(name);
        shader.stages.push(Stage {
            image: StageImage::Map("*default".to_owned()),
            ..Stage::default()
        });
        shader
    }

    fn from_image(name: &str, image: StageImage, kind: ImplicitKind) -> Shader {
        let stage = |rgb_gen: RgbGen| Stage {
            image: image.clone(),
            rgb_gen,
            ..Stage::default()
        };
        let filter = || Stage {
            blend: Some((BlendFactor::DstColor, BlendFactor::Zero)),
            depth_write: false,
            ..stage(RgbGen::Identity)
        };
        let mut shader = Shader::new(name);
        shader.stages = match kind {
            ImplicitKind::EntityLit => vec![stage(RgbGen::LightingDiffuse)],
            ImplicitKind::White => vec![Stage::default(), filter()],
            ImplicitKind::Vertex => vec![Stage {
                alpha_gen: AlphaGen::Vertex,
                ..stage(RgbGen::ExactVertex)
            }],
            ImplicitKind::TwoD => vec![Stage {
                alpha_gen: AlphaGen::Vertex,
                blend: Some((BlendFactor::SrcAlpha, BlendFactor::OneMinusSrcAlpha)),
                depth_func: DepthFunc::Disabled,
                depth_write: false,
                ..stage(RgbGen::Vertex)
            }],
            ImplicitKind::Lightmapped => vec![
                Stage {
                    image: StageImage::Lightmap,
                    tc_gen: TcGen::Lightmap,
                    ..stage(RgbGen::Identity)
                },
                filter(),
            ],
        };
        shader
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::sort;

    #[test]
    fn each_kind_sorts_as_the_engine_sorts_it() {
        for (kind, value, stages) in [
            (ImplicitKind::EntityLit, sort::OPAQUE, 1),
            (ImplicitKind::White, sort::OPAQUE, 2),
            (ImplicitKind::Vertex, sort::OPAQUE, 1),
            (ImplicitKind::TwoD, sort::BLEND, 1),
            (ImplicitKind::Lightmapped, sort::OPAQUE, 2),
        ] {
            let shader = Shader::implicit("textures/a/b", kind);
            assert_eq!(shader.sort_value(), value, "{kind:?}");
            assert_eq!(shader.stages.len(), stages, "{kind:?}");
            assert_eq!(shader.image_names().last(), Some("textures/a/b"));
        }
    }

    #[test]
    fn lightmapped_is_lightmap_times_image() {
        let shader = Shader::implicit("x", ImplicitKind::Lightmapped);
        assert_eq!(shader.stages[0].image, StageImage::Lightmap);
        assert_eq!(shader.stages[0].tc_gen, TcGen::Lightmap);
        assert!(shader.stages[0].depth_write);
        assert_eq!(
            shader.stages[1].blend,
            Some((BlendFactor::DstColor, BlendFactor::Zero))
        );
        assert!(!shader.stages[1].depth_write);
    }
}
