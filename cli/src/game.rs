//! Command-line arguments for the game and the maps.

use std::path::PathBuf;

use clap::Args;
use relight::{FileError, SearchPath};

// No documentation comments on these structures: clap would show them in place of the subcommand's description.

/// The game that is read where none is named.
pub const USUAL: &str = "/usr/share/games/openarena/baseoa";

// The game whose files a command reads.
#[derive(Args, Clone, Debug)]
pub struct Game {
    /// Game folder with packs, or one pack (.pk3); repeat it in ascending priority (the base game first, the mod after
    /// it)
    #[arg(
        long = "game",
        value_name = "DIR",
        default_value = USUAL
    )]
    pub paths: Vec<PathBuf>,
}

impl Game {
    /// The game's files.
    ///
    /// # Errors
    /// A folder or a pack cannot be read.
    pub fn files(&self) -> Result<SearchPath, FileError> {
        let mut files = SearchPath::new();
        for path in &self.paths {
            if path.is_file() {
                files.add_pk3(path)?;
            } else {
                files.add_game_folder(path)?;
            }
        }
        Ok(files)
    }
}

// Maps, and their game.
#[derive(Args, Debug)]
pub struct Maps {
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp
    #[arg(required = true, value_name = "MAP")]
    pub maps: Vec<String>,
    #[command(flatten)]
    pub game: Game,
}
