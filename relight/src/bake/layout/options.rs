//! What a new layout is to be like.

use super::material::LightmapUse;

/// Sizes of the pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PageSides {
    /// All pages have this many texels per side.
    Fixed(u32),
    /// The smallest power of two from 128 on by which one page holds everything; if none up to this one does, this one.
    UpTo(u32),
}

/// What a new layout is to be like.
#[derive(Clone, Copy)]
pub struct LayoutOptions<'a> {
    /// Sizes of the pages.
    pub sides: PageSides,
    /// Texels per axis in place of one that the map has, or that its compiler would make.
    pub finer: f32,
    /// Distance between texels where nothing states another, id units.
    pub sample_size: f32,
    /// Texels around each chart that repeat it: bilinear filtering reads at most 1 beyond the texels of a chart, and a
    /// level n of mip maps 2^n.
    pub border: u32,
    /// Most pages.
    pub most_pages: usize,
    /// What the material of a name does with lightmaps.
    pub material: &'a dyn Fn(&str) -> LightmapUse,
}

impl<'a> LayoutOptions<'a> {
    /// Pages inside a map: those of `IBSP`, as many texels as the compiler would make, without mip maps.
    ///
    /// ioquake3 has 2,048 images in all (`MAX_DRAWIMAGES`), each page one of them, and ends the game with an error beyond:
    /// half of them are left to textures.
    pub fn internal(material: &'a dyn Fn(&str) -> LightmapUse) -> LayoutOptions<'a> {
        LayoutOptions {
            sides: PageSides::Fixed(q3bsp::LIGHTMAP_SIZE as u32),
            finer: 1.0,
            sample_size: 16.0,
            border: 1,
            most_pages: 1024,
            material,
        }
    }

    /// Pages beside a map, as images with mip maps.
    pub fn external(material: &'a dyn Fn(&str) -> LightmapUse) -> LayoutOptions<'a> {
        LayoutOptions {
            sides: PageSides::UpTo(2048),
            border: 4,
            ..LayoutOptions::internal(material)
        }
    }
}

impl std::fmt::Debug for LayoutOptions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LayoutOptions")
            .field("sides", &self.sides)
            .field("finer", &self.finer)
            .field("sample_size", &self.sample_size)
            .field("border", &self.border)
            .field("most_pages", &self.most_pages)
            .finish_non_exhaustive()
    }
}
