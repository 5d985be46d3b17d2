//! What a pack states about reflection in the language of ioquake3's `opengl2` renderer: words of scripts, `.mtr` scripts,
//! and images beside the image of a surface (`_n` and `_nh`: normals; `_s`: reflection).
//!
//! `scripts/NAME.mtr` replaces `scripts/NAME.shader` in `opengl2`. Here its words of reflection count, while the stages of
//! the `.shader` stay what is drawn, so that both looks keep the picture of the other renderers.

use std::collections::HashSet;

use glam::{Vec2, Vec3};
use shaderscript::token::number;
use shaderscript::{GlossType, Shader, SpecularStage, StageImage, TcGen, strip_extension};

use super::Materials;
use super::finish::{Finish, NormalMap, SurfaceMap};

/// Suffixes of normal maps beside an image, in the order tried, and whether they have heights in their alpha.
const NORMALS: [(&str, bool); 2] = [("_nh", true), ("_n", false)];
/// Suffix of maps of reflection beside an image.
const SPECULAR: &str = "_s";

/// What `opengl2`'s variables state for materials that state nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Usual {
    /// `r_pbr`: maps of reflection have gloss in red and metal in green.
    pbr: bool,
    /// `r_glossType`.
    gloss_type: GlossType,
    /// `r_baseNormalX`, `r_baseNormalY`: factors of normal maps.
    normal: Vec2,
    /// `r_baseParallax`: depth of heights, in texture coordinates.
    depth: f32,
    /// `r_baseSpecular`, `r_baseGloss`: where a definition states only the other.
    reflectance: f32,
    gloss: f32,
}

impl Default for Usual {
    fn default() -> Self {
        Usual::of_variables(&|_| String::new())
    }
}

impl Usual {
    /// By the engine's variables; those that it does not have are as `opengl2` sets them.
    pub(super) fn of_variables(variable: &dyn Fn(&str) -> String) -> Usual {
        let or = |name: &str, usual: f32| match variable(name) {
            text if text.is_empty() => usual,
            text => Some(number(&text))
                .filter(|n| n.is_finite())
                .unwrap_or(usual),
        };
        Usual {
            pbr: or("r_pbr", 0.0) != 0.0,
            gloss_type: GlossType::of_variable(&variable("r_glossType")),
            normal: Vec2::new(or("r_baseNormalX", 1.0), or("r_baseNormalY", 1.0)),
            depth: or("r_baseParallax", 0.05),
            reflectance: or("r_baseSpecular", 0.04),
            gloss: or("r_baseGloss", 0.3),
        }
    }
}

impl Materials {
    /// What packs state about a material that is drawn by `shader`. `exists`: whether there is an image of a name.
    pub fn of_pack(&self, name: &str, shader: &Shader, exists: &dyn Fn(&str) -> bool) -> Finish {
        let stated = self
            .reflections()
            .find(name)
            .filter(|shader| shader.rejected.is_none())
            .map(|shader| &shader.reflection);
        let normals = stated.and_then(|r| r.normals.clone());
        let specular = stated.and_then(|r| r.specular.clone());
        let image = first_image(shader);
        let beside = |suffix: &str| {
            let name = format!("{}{suffix}", strip_extension(image?));
            (exists(&name) && !self.drawn().contains(&name.to_ascii_lowercase())).then_some(name)
        };
        let usual = &self.usual;
        let normals = normals.map(|stage| {
            let scale = stage.scale.unwrap_or(usual.normal);
            let depth = stage.depth.unwrap_or(usual.depth);
            let depth = if stage.heights { depth } else { 0.0 };
            NormalMap::downward(stage.image, scale, depth)
        });
        let normals = normals.or_else(|| {
            let image = |&(suffix, heights)| Some((beside(suffix)?, heights));
            let (image, heights) = NORMALS.iter().find_map(image)?;
            let depth = if heights { usual.depth } else { 0.0 };
            Some(NormalMap::downward(image, usual.normal, depth))
        });
        let mut finish = Finish {
            normals,
            ..Finish::default()
        };
        let has_map = |specular: &SpecularStage| specular.image.is_some();
        match specular {
            Some(specular) if has_map(&specular) => self.of_stage(&specular, &mut finish),
            specular => match beside(SPECULAR) {
                Some(name) => {
                    let map = SpecularStage {
                        image: Some(name),
                        metallic: usual.pbr,
                        ..SpecularStage::default()
                    };
                    self.of_stage(&map, &mut finish);
                }
                None => {
                    if let Some(specular) = specular {
                        self.of_words(&specular, &mut finish);
                    }
                }
            },
        }
        finish
    }

    /// Images that scripts draw, and the names of their definitions, in lower case and without extensions: they are no
    /// maps of another image, whatever their names end with.
    fn drawn(&self) -> &HashSet<String> {
        self.drawn.get_or_init(|| {
            let lower = |name: &str| strip_extension(name).to_ascii_lowercase();
            let definitions = self.library.definitions();
            let images = definitions.iter().flat_map(|shader| &shader.stages);
            let images = images
                .flat_map(|stage| stage.image.names())
                .map(|name| lower(name));
            images
                .chain(definitions.iter().map(|shader| lower(&shader.name)))
                .collect()
        })
    }

    /// A map and its factors; what is not stated is 1.
    fn of_stage(&self, specular: &SpecularStage, finish: &mut Finish) {
        let Some(image) = specular.image.clone() else {
            return;
        };
        let gloss = specular.gloss.map_or(1.0, unit);
        let scale = (gloss * 255.0).round() as u8;
        let gloss_type = self.usual.gloss_type;
        if specular.metallic {
            finish.surface = Some(SurfaceMap::GlossMetal {
                image,
                scale,
                gloss_type,
            });
            finish.metal = specular.metal.map(unit);
            return;
        }
        finish.reflectance = specular.reflectance.map(units);
        (finish.surface, finish.roughness) = match gloss_type {
            GlossType::Smoothness => (Some(SurfaceMap::Specular(image)), Some(1.0 - gloss)),
            _ => {
                let map = SurfaceMap::Gloss {
                    image,
                    scale,
                    gloss_type,
                };
                (Some(map), Some(0.0))
            }
        };
    }

    /// Words without a map; what is not stated is as `opengl2` has it.
    fn of_words(&self, specular: &SpecularStage, finish: &mut Finish) {
        let usual = &self.usual;
        let gloss = specular.gloss.unwrap_or(usual.gloss);
        finish.roughness = Some(unit(usual.gloss_type.roughness(gloss)));
        if specular.metallic {
            finish.metal = Some(unit(specular.metal.unwrap_or(0.0)));
        } else {
            let usual = Vec3::splat(usual.reflectance);
            finish.reflectance = Some(units(specular.reflectance.unwrap_or(usual)));
        }
    }
}

/// The image of the first stage of colour.
fn first_image(shader: &Shader) -> Option<&str> {
    let color = |stage: &&shaderscript::Stage| stage.tc_gen != TcGen::Lightmap;
    let stage = shader.stages.iter().find(color)?;
    match &stage.image {
        StageImage::Map(name) | StageImage::ClampMap(name) if stage.tc_gen == TcGen::Base => {
            Some(name)
        }
        _ => None,
    }
}

fn unit(value: f32) -> f32 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    }
}

fn units(color: Vec3) -> Vec3 {
    Vec3::from_array(color.to_array().map(unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use shaderscript::ImplicitKind;

    fn materials(files: &[(&str, &str)]) -> Materials {
        let mut all = MemoryFiles::new();
        for (path, text) in files {
            all.insert(path, *text).unwrap();
        }
        Materials::load(&all).0
    }

    fn finish(materials: &Materials, name: &str, images: &[&str]) -> Finish {
        let shader = materials.library().find(name).cloned();
        let shader = shader.unwrap_or_else(|| Shader::implicit(name, ImplicitKind::Lightmapped));
        materials.of_pack(name, &shader, &|image| images.contains(&image))
    }

    #[test]
    fn images_beside_the_image() {
        let materials = materials(&[(
            "scripts/a.shader",
            "t/b\n{\n{\nmap t/wall.tga\n}\n{\nmap $lightmap\n}\n}\nt/c_s\n{\n{\nmap t/d_n.tga\n}\n}\n",
        )]);
        assert_eq!(finish(&materials, "t/a", &[]), Finish::default());
        let both = finish(&materials, "t/a", &["t/a_n", "t/a_nh", "t/a_s"]);
        let normals = both.normals.unwrap();
        assert_eq!((normals.image.as_str(), normals.depth), ("t/a_nh", 0.05));
        assert_eq!(both.surface, Some(SurfaceMap::Specular("t/a_s".to_owned())));
        let images = ["t/wall_n", "t/b_n"];
        let of_script = finish(&materials, "t/b", &images).normals;
        let normals = of_script.unwrap();
        assert_eq!((normals.image.as_str(), normals.depth), ("t/wall_n", 0.0));
        // images and names that scripts use are no maps
        assert_eq!(finish(&materials, "t/c", &["t/c_s"]), Finish::default());
        assert_eq!(finish(&materials, "t/d", &["t/d_n"]), Finish::default());
    }

    #[test]
    fn words_of_scripts_and_of_mtr_files() {
        let plain = "t/a\n{\n{\nmap t/a\n}\n}\n";
        let words = "t/a\n{\n{\nmap t/other\ngloss 0.8\n}\n{\nstage normalMap\nmap t/x\nnormalScale 2\n}\n}\nt/m\n{\n{\nmap t/m\n}\n{\nstage specularMap\nmap t/m_m\nspecularScale 0.5 0.6 0.7 0.25\n}\n}\n";
        let alone = materials(&[("scripts/b.mtr", words), ("scripts/a.shader", plain)]);
        assert_eq!(finish(&alone, "t/a", &[]), Finish::default(), "no b.shader");
        let replaced = materials(&[("scripts/a.mtr", words), ("scripts/a.shader", plain)]);
        let a = finish(&replaced, "t/a", &["t/a_n"]);
        let normals = NormalMap {
            image: "t/x".to_owned(),
            scale: Vec2::new(2.0, -2.0), // y of the map points down
            depth: 0.0,
        };
        assert_eq!(a.normals, Some(normals));
        assert!((a.roughness.unwrap() - 0.2).abs() < 1e-6);
        assert_eq!(a.reflectance, Some(Vec3::splat(0.04)));
        // what is drawn is the .shader's
        let drawn = replaced.library().find("t/a").unwrap();
        assert_eq!(drawn.image_names().collect::<Vec<_>>(), ["t/a"]);
        let m = finish(&replaced, "t/m", &[]);
        assert_eq!(m.surface, Some(SurfaceMap::Specular("t/m_m".to_owned())));
        assert_eq!(m.reflectance, Some(Vec3::new(0.5, 0.6, 0.7)));
        assert_eq!(m.roughness, Some(0.75));
        // a definition with a fault states nothing, and is reported
        let wrong = "t/a\n{\n{\nmap t/a\nroughness 0.5\nrouhgness 0.5\n}\n}\nt/b\n{\n{\nmap t/b\nroughness\n}\n}\n";
        let wrong = materials(&[("scripts/a.mtr", wrong), ("scripts/a.shader", plain)]);
        assert_eq!(finish(&wrong, "t/a", &[]), Finish::default());
        let fault = wrong.mtr_faults("T/a").next().unwrap().to_string();
        assert!(
            fault.starts_with("scripts/a.mtr:6:") && fault.contains("rouhgness"),
            "{fault}"
        );
        assert_eq!(wrong.mtr_faults("t/b").count(), 1);
        assert_eq!(wrong.mtr_faults("t/c").count(), 0);
    }

    #[test]
    fn variables_of_opengl2_state_what_materials_do_not() {
        let text = "t/a\n{\n{\nmap t/a\nspecularReflectance 0.5\n}\n{\nstage normalParallaxMap\nmap t/x\n}\n}\nt/b\n{\n{\nmap t/b\nspecularReflectance 0.5\ngloss 0.5\n}\n{\nstage normalParallaxMap\nmap t/x\nnormalScale 1 1 0.2\n}\n}\n";
        let mut materials = materials(&[("scripts/a.shader", text)]);
        let a = finish(&materials, "t/a", &[]);
        assert!((a.roughness.unwrap() - 0.7).abs() < 1e-6);
        assert_eq!(
            a.normals.map(|n| (n.scale.to_array(), n.depth)),
            Some(([1.0, -1.0], 0.05))
        );
        let variable = |name: &str| {
            let value = match name {
                "r_glossType" => "0",
                "r_baseNormalX" => "0.5",
                "r_baseNormalY" => "2",
                "r_baseParallax" => "0.1",
                "r_baseGloss" => "1",
                _ => "",
            };
            value.to_owned()
        };
        materials.usual = Usual::of_variables(&variable);
        let a = finish(&materials, "t/a", &["t/a_s"]);
        let map = SurfaceMap::Gloss {
            image: "t/a_s".to_owned(),
            scale: 255,
            gloss_type: GlossType::Gloss,
        };
        assert_eq!((a.surface, a.roughness), (Some(map), Some(0.0)));
        let a = finish(&materials, "t/a", &[]);
        assert_eq!(a.roughness, Some(0.125));
        assert_eq!(
            a.normals.map(|n| (n.scale.to_array(), n.depth)),
            Some(([0.5, -2.0], 0.1))
        );
        let b = finish(&materials, "t/b", &[]);
        assert_eq!(b.roughness, Some(0.5_f32.powf(1.5)));
        assert_eq!(
            b.normals.map(|n| (n.scale.to_array(), n.depth)),
            Some(([1.0, -1.0], 0.2))
        );
    }
}
