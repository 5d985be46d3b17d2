//! Runs scenes on both renderers, each in a process of its own: a renderer owns its window, its context and its
//! global state.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::sheet::{self, Outcome};
use super::{Scene, Stage};
use crate::data;
use crate::display::Display;

/// Which renderer plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Player {
    /// The engine's own `opengl1`: what the pictures have to look like.
    Reference,
    /// Relight.
    Ours,
    /// Relight in the traced look, to be looked at: nothing is equal to it.
    Traced,
}

impl Player {
    /// Those that are compared, the reference first.
    pub const BOTH: [Self; 2] = [Self::Reference, Self::Ours];

    /// The name that the program takes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reference => "opengl1",
            Self::Ours => "vk",
            Self::Traced => "traced",
        }
    }

    /// The player of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Reference, Self::Ours, Self::Traced]
            .into_iter()
            .find(|p| p.name() == name)
    }

    /// Console variables that it wants beside those of a scene.
    pub fn cvars(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Traced => &[("r_rt", "1")],
            _ => &[],
        }
    }

    /// Its library, if it is there.
    fn library(self) -> Option<PathBuf> {
        match self {
            Self::Reference => data::engine_renderer("opengl1"),
            Self::Ours | Self::Traced => Some(data::library()),
        }
    }
}

/// Plays scenes in this process and leaves `SCENE.NAME.png` and `SCENE.txt` in `folder`. A scene that fails leaves
/// `SCENE.failed` with the reason; the next one is played all the same.
pub fn play(
    player: Player,
    library: &Path,
    scenes: &[Scene],
    folder: &Path,
) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for scene in scenes {
        let played = std::panic::catch_unwind(|| {
            let mut stage =
                Stage::start(player.cvars(), library, scene, folder).map_err(|e| e.to_string())?;
            (scene.play)(&mut stage).map_err(|e| e.to_string())?;
            let bad = [stage.violations(), stage.validation_messages()].concat();
            stage.finish().map_err(|e| e.to_string())?;
            Ok::<_, String>(bad)
        });
        let failure = match played {
            Ok(Ok(bad)) => bad.join("\n"),
            Ok(Err(message)) => message,
            Err(_) => "the scene panicked; its message is above".to_string(),
        };
        if !failure.is_empty() {
            std::fs::write(folder.join(format!("{}.failed", scene.name)), failure)?;
        }
        // Last: it marks the end of the scene.
        std::fs::write(folder.join(format!("{}.done", scene.name)), "")?;
    }
    Ok(())
}

/// Plays scenes on both renderers in processes of `program` (the gallery's own), compares what they left below
/// `folder`, and writes the contact sheet there. `None`, with a line with the reason, where something is not installed.
///
/// # Panics
/// When processes or files fail.
pub fn compare(program: &Path, scenes: &[Scene], folder: &Path) -> Option<Vec<Outcome>> {
    let display = Display::start()?;
    for player in Player::BOTH {
        let library = player.library()?;
        let folder = folder.join(player.name());
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("the folder is made");
        let mut left: Vec<&Scene> = scenes.iter().collect();
        while let Some(first) = left.first().map(|s| s.name) {
            let mut child = Command::new(program);
            display.lend_to(&mut child);
            child.args(["--play", player.name()]).arg(&folder);
            child.args(left.iter().map(|s| s.name));
            child.env("RELIGHT_LIBRARY", &library);
            let status = child.status().expect("the gallery runs");
            let before = left.len();
            left.retain(|s| !folder.join(format!("{}.done", s.name)).is_file());
            if left.is_empty() {
                break;
            }
            // A renderer that crashed takes its process along: that scene failed, the others go on.
            let culprit = left.first().map_or(first, |s| s.name);
            let file = folder.join(format!("{culprit}.failed"));
            std::fs::write(file, format!("the process ended: {status}")).expect("a file");
            left.remove(0);
            assert!(left.len() < before, "no scene was played");
        }
    }
    let outcomes = sheet::compare(scenes, folder);
    sheet::write(scenes, &outcomes, folder).expect("the contact sheet is written");
    Some(outcomes)
}
