//! What a material's directives say about lightmaps.

use crate::materials::Materials;
use crate::materials::light::{BakedLight, baked_light};
use shaderscript::{Shader, StageImage};

/// What [`make`](super::make) needs to know of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightmapUse {
    /// Whether the material shows the page that the map assigns to a surface.
    pub shows_page: bool,
    /// Whether it shows light of further styles, at places of the present pages that its script names.
    pub styled: bool,
    /// Texels per side of the image that it shows in place of a page of the map; `None` without one. Surfaces with it get
    /// charts, too.
    pub image: Option<u32>,
    /// `q3map_lightmapSampleSize`: distance between texels, id units.
    pub sample_size: Option<f32>,
}

impl Default for LightmapUse {
    /// Of a material without script.
    fn default() -> LightmapUse {
        LightmapUse {
            shows_page: true,
            styled: false,
            image: None,
            sample_size: None,
        }
    }
}

impl LightmapUse {
    /// Of a material by its name.
    pub fn of(materials: &Materials, name: &str) -> LightmapUse {
        let script = materials.library().find(name);
        script.map_or_else(LightmapUse::default, LightmapUse::of_script)
    }

    /// Of a script. A rejected one is drawn with the default material, which shows the page.
    pub fn of_script(script: &Shader) -> LightmapUse {
        let light = baked_light(&script.stages);
        let styled = light.contains(&Some(BakedLight::Style));
        let mut shown = script.stages.iter().zip(light);
        let own = |stage: &shaderscript::Stage| stage.image == StageImage::Lightmap;
        let shows_page = shown.any(|(stage, light)| light.is_some() && own(stage));
        let vertex_lit = |name: &String| name == "pointlight" || name == "nolightmap";
        let sizes = script
            .unknown
            .iter()
            .filter(|line| (line.keyword).eq_ignore_ascii_case("q3map_lightmapSampleSize"));
        let sizes = sizes.filter_map(|line| line.arguments.first());
        let size = sizes
            .map(|text| shaderscript::token::number(text))
            .next_back();
        LightmapUse {
            shows_page: (shows_page || script.rejected.is_some())
                && !script.surface_params.iter().any(vertex_lit),
            styled,
            image: None,
            sample_size: size.filter(|size| *size > 0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaderscript::parse_script;

    fn of(body: &str) -> LightmapUse {
        let script = parse_script("s", format!("t\n{{\n{body}\n}}\n").as_bytes());
        LightmapUse::of_script(&script.shaders[0])
    }

    #[test]
    fn directives_decide() {
        let lit = "{\nmap $lightmap\n}\n{\nmap a\nblendFunc filter\n}";
        let plain = LightmapUse::default();
        assert_eq!(of(lit), plain);
        assert!(!of(&format!("surfaceparm pointlight\n{lit}")).shows_page);
        assert!(!of("{\nmap a\nrgbGen vertex\n}").shows_page);
        assert!(!of("{\nmap maps/m/lm_0000.tga\ntcGen lightmap\n}").shows_page);
        let pulse = "rgbGen wave sin 0.5 0.5 0 1\ntcMod transform 1 0 0 1 0.5 0";
        let style = format!("{lit}\n{{\nmap $lightmap\nblendFunc add\n{pulse}\n}}");
        assert!(of(&style).styled && of(&style).shows_page);
        let fine = of(&format!("q3map_lightmapSampleSize 4\n{lit}"));
        assert_eq!(fine.sample_size, Some(4.0));
    }
}
