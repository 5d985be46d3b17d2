//! Fonts that are stored as images.

use q3model::FontInfo;

use super::Assets;
use super::material::LightmapClass;

/// Default font size, points.
const DEFAULT_POINT_SIZE: i32 = 12;

/// A font with the handles of its glyphs' materials.
#[derive(Clone, Debug)]
pub struct LoadedFont {
    /// Name of the file that it was read from.
    pub name: String,
    /// The table.
    pub info: FontInfo,
    /// For each glyph the handle of its material; 0: no material.
    pub handles: Vec<i32>,
}

impl Assets {
    /// The font of a size, read from `fonts/fontImage_<size>.dat` at its first use; `None`, with a warning, if there is
    /// no such file.
    pub fn register_font(&mut self, point_size: i32) -> Option<LoadedFont> {
        let size = if point_size <= 0 {
            DEFAULT_POINT_SIZE
        } else {
            point_size
        };
        let name = format!("fonts/fontImage_{size}.dat");
        if let Some(font) = self.fonts.iter().find(|font| font.name == name) {
            return Some(font.clone());
        }
        let bytes = match self.textures.files().read(&name) {
            Ok(Some(bytes)) => bytes,
            Ok(None) => {
                log::warn!("{name}: no such font");
                return None;
            }
            Err(problem) => {
                log::warn!("{problem}");
                return None;
            }
        };
        let info = match FontInfo::parse(&bytes) {
            Ok(info) => info,
            Err(problem) => {
                log::warn!("{name}: {problem}");
                return None;
            }
        };
        let handles = info
            .glyphs
            .iter()
            .map(|glyph| {
                let index = self.materials.find(
                    &mut self.textures,
                    &glyph.shader,
                    LightmapClass::TwoD,
                    false,
                );
                let usable = !self.materials.get(index).defaulted;
                i32::try_from(index).ok().filter(|_| usable).unwrap_or(0)
            })
            .collect();
        let font = LoadedFont {
            name,
            info,
            handles,
        };
        self.fonts.push(font.clone());
        Some(font)
    }
}
