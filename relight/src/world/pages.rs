//! Baked light that scripts name besides the surfaces' own pages: lightmap images, and light styles.
//!
//! [`crate::materials::light::baked_light`] finds the stages. They are removed from the materials: the main light
//! becomes an ordinary `$lightmap` stage with an image as its page, and the stages of styles are taken out, so that
//! a material has one light and the albedo below it.

use crate::emitters::StyleStrength;
use crate::files::GameFiles;
use crate::image::{self, Image};
use crate::materials::light::{BakedLight, baked_light};
use q3bsp::Lightmap;
use shaderscript::{Shader, Stage, StageImage, TcMod};
use std::collections::HashMap;
use support::slice::item;

/// Baked light of a material besides the page that the map assigns to each surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BakedPages {
    /// Index into [`RelitWorld::pages`](crate::RelitWorld::pages) of the page that has the main light; `None`: the surface's own.
    pub main: Option<u32>,
    /// Light of further styles, in the order of the stages.
    pub styles: Vec<StyleLight>,
}

/// Baked light of a style: its page and its strength over time.
#[derive(Debug, Clone, PartialEq)]
pub struct StyleLight {
    /// Index into [`RelitWorld::pages`](crate::RelitWorld::pages); `None`: the surface's own page.
    pub page: Option<u32>,
    /// From lightmap coordinates to those of this light.
    pub tc_mods: Vec<TcMod>,
    /// Factor on it.
    pub strength: StyleStrength,
}

/// Loader of pages that scripts name; each is loaded once.
pub(crate) struct PageLoader<'a> {
    files: &'a dyn GameFiles,
    known: HashMap<String, Option<u32>>,
    pub pages: Vec<Lightmap>,
    /// Game path of the file of each.
    pub files_of_pages: Vec<String>,
    /// What could not be read.
    pub warnings: Vec<String>,
}

impl<'a> PageLoader<'a> {
    pub fn new(files: &'a dyn GameFiles) -> PageLoader<'a> {
        PageLoader {
            files,
            known: HashMap::new(),
            pages: Vec::new(),
            files_of_pages: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Removes baked light from a material's stages except for one `$lightmap` stage, and returns it.
    pub fn take(&mut self, shader: &mut Shader) -> BakedPages {
        let mut baked = BakedPages::default();
        let mut kinds = baked_light(&shader.stages).into_iter();
        let mut stages = std::mem::take(&mut shader.stages);
        stages.retain_mut(|stage| match kinds.next().flatten() {
            Some(BakedLight::Style) => {
                baked.styles.push(StyleLight {
                    page: self.page(stage),
                    tc_mods: stage.tc_mods.clone(),
                    strength: StyleStrength::of(stage),
                });
                false
            }
            Some(BakedLight::Main) => {
                let page = self.page(stage).filter(|_| stage.tc_mods.is_empty());
                baked.main = baked.main.or(page);
                stage.image = StageImage::Lightmap;
                true
            }
            None => true,
        });
        shader.stages = stages;
        baked
    }

    /// Page of a stage's image; `None` for `$lightmap` and unusable images.
    fn page(&mut self, stage: &Stage) -> Option<u32> {
        let name = stage.image.names().first()?;
        if let Some(&page) = self.known.get(&name.to_ascii_lowercase()) {
            return page;
        }
        let page = match image::load(self.files, name) {
            Ok(found) => found.map(|(image, path)| {
                self.pages.push(square(&image));
                self.files_of_pages.push(path);
                self.pages.len() as u32 - 1
            }),
            Err(problem) => {
                self.warnings.push(problem.to_string());
                None
            }
        };
        self.known.insert(name.to_ascii_lowercase(), page);
        page
    }
}

/// A square page from an image: texels of its shorter side are repeated.
fn square(image: &Image) -> Lightmap {
    let side = image.width.max(image.height) as usize;
    let (width, height) = (image.width as usize, image.height as usize);
    let texels = image.rgba.as_chunks::<4>().0;
    let at = |x: usize, y: usize| item(texels, y * height / side * width + x * width / side);
    let bytes = (0..side * side).flat_map(|i| {
        let [r, g, b, _] = at(i % side, i / side);
        [r, g, b]
    });
    Lightmap(bytes.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use crate::image::tests::rgb_tga;
    use glam::Vec2;
    use shaderscript::eval;
    use shaderscript::parse_script;

    #[test]
    fn light_leaves_the_stages_and_keeps_its_place() {
        let mut files = MemoryFiles::new();
        files
            .insert("maps/m/lm_0000.tga", rgb_tga(2, 1, &[1, 2, 3, 4, 5, 6]))
            .unwrap();
        let script = "t\n{\n{\nmap maps/m/LM_0000.tga\ntcGen lightmap\n}\n\
            {\nmap $lightmap\nblendFunc add\nrgbGen wave square 0.5 0.5 0 1\ntcMod transform 1 0 0 1 0.5 0\n}\n\
            {\nmap maps/m/lm_0000\nblendFunc add\ntcGen lightmap\ntcMod transform 1 0 0 1 0 0.25\nrgbGen const ( 0.5 0.5 0.5 )\n}\n\
            {\nmap a\nblendFunc filter\n}\n}\n";
        let mut shader = parse_script("s", script.as_bytes()).shaders.remove(0);
        let mut loader = PageLoader::new(&files);
        let baked = loader.take(&mut shader);
        let images: Vec<_> = shader.stages.iter().map(|s| s.image.clone()).collect();
        assert_eq!(images, [StageImage::Lightmap, StageImage::Map("a".into())]);
        assert_eq!(baked.main, Some(0));
        let [own, image] = &baked.styles[..] else {
            panic!("{baked:?}")
        };
        assert_eq!(
            (own.page, own.strength.at(0.25), own.strength.at(0.75)),
            (None, 1.0, 0.0)
        );
        assert_eq!(image.strength, StyleStrength::Steady(0.5));
        let moved =
            eval::apply_tc_mods(&own.tc_mods, Vec2::ZERO, glam::Vec3::ZERO, 0.0, Vec2::ZERO);
        assert_eq!(moved, Vec2::new(0.5, 0.0));
        // blue, green, red in the file; one row becomes two
        assert_eq!(loader.files_of_pages.len(), loader.pages.len());
        assert_eq!(loader.files_of_pages[0], "maps/m/LM_0000.tga");
        assert_eq!(loader.pages[0].0[..], [3, 2, 1, 6, 5, 4, 3, 2, 1, 6, 5, 4]);
    }
}
