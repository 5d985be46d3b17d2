//! Images and materials in maps of formats without scripts; they precede the game's.

use q3bsp::Bsp;
use relight::{GameFiles, Materials, Overlay, map_files};

/// A game with the files of such a map.
pub struct Brought<'a> {
    /// The map's images and script, then the game's files.
    pub files: Overlay<&'a dyn GameFiles>,
    /// The materials of the map and of the game.
    pub materials: Materials,
    /// Warnings about the map's images and materials.
    pub warnings: Vec<String>,
}

impl<'a> Brought<'a> {
    /// `None` for maps whose materials are in the game's scripts.
    pub fn new(game: &'a dyn GameFiles, bsp: &Bsp) -> Option<Brought<'a>> {
        let (front, warnings) = map_files(bsp, game)?;
        let files = Overlay { front, back: game };
        let (materials, _) = Materials::load(&files);
        Some(Brought {
            files,
            materials,
            warnings,
        })
    }
}
