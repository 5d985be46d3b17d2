//! Which stages of a material show baked light, decided from its directives.
//!
//! Map compilers store light in pages: in the map (`$lightmap`), or in images beside it, which a script that the compiler
//! writes names by path with `tcGen lightmap` (q3map2 `-lightmapsize`, `q3map_lightmapSize`, `-external`). Light of further
//! styles follows as stages that are added: `$lightmap` moved to another part of a page by `tcMod transform`, or another
//! page, each with the wave of its style (q3map2 `q3map_styleMarker`).

use shaderscript::{BlendFactor, RgbGen, Stage, StageImage, TcGen, TcMod};

/// The baked light that a stage shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BakedLight {
    /// The light of style 0, which does not change.
    Main,
    /// The light of a further style, added to the main light: a light source of its own, not a brighter surface.
    Style,
}

/// For each stage the baked light that it shows; `None` for every other picture.
///
/// A stage shows baked light where its image is `$lightmap`, or where an image has the coordinates of the lightmap and is
/// combined as light is: it fills, multiplies or adds. An image that covers by its alpha is paint. A stage that adds such
/// light to an earlier light stage is a style where it shows another page, another part of the page, or pulses.
pub fn baked_light(stages: &[Stage]) -> Vec<Option<BakedLight>> {
    let mut main: Option<&Stage> = None;
    let kind = |stage: &'_ Stage, main: Option<&Stage>| {
        if !shows_light(stage) {
            return None;
        }
        let differs = main.is_some_and(|main| {
            (&stage.image, &stage.tc_mods) != (&main.image, &main.tc_mods)
                || matches!(stage.rgb_gen, RgbGen::Wave(_))
        });
        Some(match differs && adds(stage) {
            true => BakedLight::Style,
            false => BakedLight::Main,
        })
    };
    stages
        .iter()
        .map(|stage| {
            let found = kind(stage, main);
            if found == Some(BakedLight::Main) {
                main.get_or_insert(stage);
            }
            found
        })
        .collect()
}

/// Whether a stage's image is a page of light rather than a picture.
fn shows_light(stage: &Stage) -> bool {
    match stage.image {
        StageImage::Lightmap => true,
        StageImage::Map(_) | StageImage::ClampMap(_) => {
            stage.tc_gen == TcGen::Lightmap
                && is_still(&stage.tc_mods)
                && stage.alpha_func.is_none()
                && (stage.blend.is_none() || multiplies(stage) || adds(stage))
        }
        StageImage::Animation { .. } | StageImage::Video(_) | StageImage::White => false,
    }
}

/// Whether changes of coordinates are the same at all times.
fn is_still(tc_mods: &[TcMod]) -> bool {
    let still = |m: &TcMod| matches!(m, TcMod::Scale(_) | TcMod::Transform { .. });
    tc_mods.iter().all(still)
}

fn multiplies(stage: &Stage) -> bool {
    use BlendFactor::{DstColor, SrcColor, Zero};
    matches!(
        stage.blend,
        Some((DstColor, Zero | SrcColor) | (Zero, SrcColor))
    )
}

fn adds(stage: &Stage) -> bool {
    use BlendFactor::{One, SrcAlpha};
    matches!(stage.blend, Some((One | SrcAlpha, One)))
}

#[cfg(test)]
mod tests {
    use super::BakedLight::{Main, Style};
    use super::*;
    use shaderscript::parse_script;

    fn found(stages: &str) -> Vec<Option<BakedLight>> {
        let script = parse_script("test", format!("t\n{{\n{stages}\n}}\n").as_bytes());
        assert_eq!(script.diagnostics, []);
        baked_light(&script.shaders.first().unwrap().stages)
    }

    const TEXTURE: &str = "{\nmap a\nblendFunc filter\n}";

    #[test]
    fn pages_by_path_are_light_where_the_coordinates_are_the_lightmaps() {
        let page = "{\nmap maps/m/lm_0000.tga\nrgbGen identity\ntcGen lightmap\n}";
        assert_eq!(found(&format!("{page}\n{TEXTURE}")), [Some(Main), None]);
        let filter = "{\nmap p\ntcGen lightmap\nblendFunc filter\n}";
        assert_eq!(
            found(&format!("{{\nmap a\n}}\n{filter}")),
            [None, Some(Main)]
        );
        // on other coordinates it is a picture, and so is what covers or moves
        for other in [
            "{\nmap p\nblendFunc filter\n}",
            "{\nmap p\ntcGen lightmap\nblendFunc blend\n}",
            "{\nmap p\ntcGen lightmap\nalphaFunc GE128\n}",
            "{\nmap p\ntcGen lightmap\nblendFunc filter\ntcMod scroll 1 0\n}",
            "{\nanimMap 2 p q\ntcGen lightmap\nblendFunc filter\n}",
        ] {
            assert_eq!(
                found(&format!("{{\nmap a\n}}\n{other}")),
                [None, None],
                "{other}"
            );
        }
    }

    #[test]
    fn styles_are_light_that_is_added_from_elsewhere_or_pulses() {
        let with = |style: &str| found(&format!("{{\nmap $lightmap\n}}\n{style}\n{TEXTURE}"))[1];
        let add = "blendFunc GL_SRC_ALPHA GL_ONE";
        let style = |rest: &str| with(&format!("{{\nmap $lightmap\n{add}\n{rest}\n}}"));
        assert_eq!(style("tcMod transform 1 0 0 1 0.5 0"), Some(Style));
        assert_eq!(style("rgbGen wave sin 0.5 0.5 0 1"), Some(Style));
        assert_eq!(style(""), Some(Main));
        let page = format!("{{\nmap maps/m/lm_0001.tga\n{add}\ntcGen lightmap\n}}");
        assert_eq!(with(&page), Some(Style));
        // light that nothing lit lies under is no style
        assert_eq!(
            found("{\nmap a\n}\n{\nmap $lightmap\nblendFunc add\n}"),
            [None, Some(Main)]
        );
    }
}
