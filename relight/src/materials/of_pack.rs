//! What a pack states about reflection in the language of ioquake3's `opengl2` renderer: words of scripts, `.mtr` scripts,
//! and images beside the image of a surface (`_n` and `_nh`: normals; `_s`: reflection).
//!
//! `scripts/NAME.mtr` replaces `scripts/NAME.shader` in `opengl2`. Here its words of reflection count, while the stages of
//! the `.shader` stay what is drawn, so that both looks keep the picture of the other renderers.

use std::collections::HashSet;

use glam::{Vec2, Vec3};
use shaderscript::{Shader, SpecularStage, StageImage, TcGen, strip_extension};

use super::Materials;
use super::finish::{Finish, NormalMap, SurfaceMap};

/// Suffixes of normal maps beside an image, in the order tried. Heights in the alpha of the first are not used.
const NORMALS: [&str; 2] = ["_nh", "_n"];
/// Suffix of maps of reflection beside an image.
const SPECULAR: &str = "_s";
/// Reflectance and smoothness of `opengl2` (`r_baseSpecular`, `r_baseGloss`) where a definition states only the other.
const BASE_SPECULAR: f32 = 0.04;
const BASE_GLOSS: f32 = 0.3;

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
        let normals = normals.map(|stage| NormalMap::downward(stage.image, stage.scale));
        let normals = normals.or_else(|| {
            let image = NORMALS.iter().find_map(|suffix| beside(suffix))?;
            Some(NormalMap::downward(image, Vec2::ONE))
        });
        let mut finish = Finish {
            normals,
            ..Finish::default()
        };
        let has_map = |specular: &SpecularStage| specular.image.is_some();
        match specular {
            Some(specular) if has_map(&specular) => of_stage(&specular, &mut finish),
            specular => match beside(SPECULAR) {
                Some(name) => {
                    let map = SpecularStage {
                        image: Some(name),
                        metallic: self.pbr,
                        ..SpecularStage::default()
                    };
                    of_stage(&map, &mut finish);
                }
                None => {
                    if let Some(specular) = specular {
                        of_words(&specular, &mut finish);
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

/// A map and its factors; what is not stated is 1.
fn of_stage(specular: &SpecularStage, finish: &mut Finish) {
    let Some(image) = specular.image.clone() else {
        return;
    };
    let smoothness = specular.smoothness.unwrap_or(1.0);
    if specular.metallic {
        let scale = (unit(smoothness) * 255.0).round() as u8;
        finish.surface = Some(SurfaceMap::SmoothnessMetal { image, scale });
        finish.metal = specular.metal.map(unit);
    } else {
        finish.surface = Some(SurfaceMap::Specular(image));
        finish.reflectance = specular.reflectance.map(units);
        finish.roughness = Some(unit(1.0 - smoothness));
    }
}

/// Words without a map; what is not stated is as `opengl2` has it.
fn of_words(specular: &SpecularStage, finish: &mut Finish) {
    finish.roughness = Some(unit(1.0 - specular.smoothness.unwrap_or(BASE_GLOSS)));
    if specular.metallic {
        finish.metal = Some(unit(specular.metal.unwrap_or(0.0)));
    } else {
        let usual = Vec3::splat(BASE_SPECULAR);
        finish.reflectance = Some(units(specular.reflectance.unwrap_or(usual)));
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
        assert_eq!(both.normals.unwrap().image, "t/a_nh");
        assert_eq!(both.surface, Some(SurfaceMap::Specular("t/a_s".to_owned())));
        let images = ["t/wall_n", "t/b_n"];
        let of_script = finish(&materials, "t/b", &images).normals;
        assert_eq!(of_script.unwrap().image, "t/wall_n");
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
        };
        assert_eq!(a.normals, Some(normals));
        assert!((a.roughness.unwrap() - 0.2).abs() < 1e-6);
        assert_eq!(a.reflectance, Some(Vec3::splat(BASE_SPECULAR)));
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
}
