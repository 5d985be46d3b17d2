//! The stages of a material that a normal map and a map of reflection vary in the classic look.
//!
//! Source: `CollapseStagesToGLSL` in `tr_shader.c` of ioquake3's `opengl2`. Its maps belong to every stage with a texture
//! of its own; here they belong to the first ([`of_pack`](relight::materials::Materials::of_pack)).

use shaderscript::{RgbGen, Shader, StageImage, TcGen};

use super::material::LightmapClass;

/// A texture under light. Stages are indices into a material's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LitTexture {
    /// Stage with the texture.
    pub texture: u32,
    /// Its light.
    pub light: TextureLight,
}

impl LitTexture {
    /// The same with indices of GPU stages; `first`: that of the material's first stage.
    pub(super) fn of_gpu(self, first: u32) -> Self {
        let light = match self.light {
            TextureLight::Lightmap(stage) => TextureLight::Lightmap(first.saturating_add(stage)),
            other => other,
        };
        LitTexture {
            texture: first.saturating_add(self.texture),
            light,
        }
    }
}

/// Light of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureLight {
    /// A lightmap, which the stage shows.
    Lightmap(u32),
    /// Vertex colours.
    Vertices,
    /// The light grid.
    Grid,
}

/// The first texture of a material, if light falls on it.
pub(super) fn lit_texture(shader: &Shader, class: LightmapClass) -> Option<LitTexture> {
    if !shader.deforms.is_empty() || shader.sky.is_some() {
        return None;
    }
    let index = |found: usize| u32::try_from(found).ok();
    let of_lightmap = |stage: &shaderscript::Stage| stage.image == StageImage::Lightmap;
    let (texture, stage) =
        (shader.stages.iter().enumerate()).find(|(_, stage)| !of_lightmap(stage))?;
    if stage.tc_gen != TcGen::Base || stage.image == StageImage::White {
        return None;
    }
    let light = match (&stage.rgb_gen, class) {
        (RgbGen::LightingDiffuse, _) => TextureLight::Grid,
        (_, LightmapClass::Page) => {
            TextureLight::Lightmap(index(shader.stages.iter().position(of_lightmap)?)?)
        }
        (RgbGen::Vertex | RgbGen::ExactVertex, LightmapClass::Vertex) => TextureLight::Vertices,
        _ => return None,
    };
    Some(LitTexture {
        texture: index(texture)?,
        light,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(stages: &str, class: LightmapClass) -> Option<(u32, TextureLight)> {
        let script = format!("a {{ {stages} }}");
        let parsed = shaderscript::parse_script("a.shader", script.as_bytes());
        let lit = lit_texture(parsed.shaders.first().unwrap(), class)?;
        Some((lit.texture, lit.light))
    }

    #[test]
    fn the_first_texture_and_its_light() {
        use LightmapClass::{None as Model, Page, Vertex, White};
        let lightmapped = "{ map $lightmap }\n{ map a.tga\nblendFunc filter }\n{ map b.tga }";
        let light = TextureLight::Lightmap(0);
        assert_eq!(found(lightmapped, Page), Some((1, light)));
        let after = "{ map a.tga\nrgbGen identity }\n{ map $lightmap\nblendFunc filter }";
        let light = TextureLight::Lightmap(1);
        assert_eq!(found(after, Page), Some((0, light)));
        assert_eq!(found(after, White), None);
        let by_vertex = "{ map a.tga\nrgbGen exactVertex }";
        assert_eq!(found(by_vertex, Vertex), Some((0, TextureLight::Vertices)));
        assert_eq!(found(by_vertex, Model), None);
        let model = "{ map a.tga\nrgbGen lightingDiffuse }";
        assert_eq!(found(model, Model), Some((0, TextureLight::Grid)));
    }

    #[test]
    fn what_shows_no_maps() {
        use LightmapClass::Page;
        assert_eq!(found("{ map a.tga }", Page), None);
        assert_eq!(found("{ map $lightmap }", Page), None);
        let reflection = "{ map a.tga\ntcGen environment }\n{ map $lightmap\nblendFunc filter }";
        assert_eq!(found(reflection, Page), None);
        let bent = "deformVertexes move 1 0 0 sin 0 1 0 1\n{ map a.tga\nrgbGen lightingDiffuse }";
        assert_eq!(found(bent, LightmapClass::None), None);
    }
}
