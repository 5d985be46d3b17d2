//! What maps of formats without scripts bring along: their pictures and materials before the game's.

use q3bsp::Bsp;
use relight::{GameFiles, Materials, Overlay, map_files};

/// A game as a map of such a format sees it.
pub struct Brought<'a> {
    /// The map's pictures and script, and the game's files behind them.
    pub files: Overlay<&'a dyn GameFiles>,
    /// The materials of both.
    pub materials: Materials,
    /// What was odd about them.
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
