//! The gallery: scenes that make the same calls on the engine's own `opengl1` and on Relight, and what came of it
//! side by side.
//!
//! ```sh
//! cargo run --release -p tests --bin gallery              # every scene; out/gallery/index.html is the contact sheet
//! cargo run --release -p tests --bin gallery -- waves 2d  # the scenes whose names begin so
//! cargo run --release -p tests --bin gallery -- --list
//! ```
//!
//! A scene is a [`Scene`]: files, console variables and a function that makes calls on a [`Stage`] and asks it to keep
//! pictures ([`Stage::keep`]) and answers of the renderer ([`Stage::fact`]). To add one, write the function in a
//! module here and name it in that module's `scenes()`, which [`scenes`] gathers. The function runs once for each
//! renderer, in a process for each, with the same files, clock and random numbers; it must not ask which one it is.
//!
//! Surfaces that show one material each are a [`board`]; [`textures`] holds pictures in which orientation, scale and
//! mip level show.

pub mod board;
pub mod model;
pub mod run;
pub mod sheet;
mod skies;
mod stage;
pub mod textures;

mod calls;
mod colors;
mod coordinates;
mod deforms;
mod effects;
mod entities;
mod image_files;
mod images;
mod materials;
mod models;
mod stages;
pub mod tube;

pub use stage::Stage;

use crate::engine::Raised;

/// A game file: its name and its bytes.
pub type File = (String, Vec<u8>);

/// How far the two renderers may differ.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Least structural similarity of any picture.
    pub ssim: f64,
    /// Largest mean absolute difference of any picture, 0 to 255.
    pub mean: f64,
    /// Largest difference of a number among the answers, relative to numbers above 1.
    pub fact: f64,
}

impl Limit {
    /// Invisible difference.
    pub const SAME: Self = Self {
        ssim: 0.995,
        mean: 1.0,
        fact: 1e-3,
    };
}

/// Calls that both renderers get.
#[derive(Clone, Copy)]
pub struct Scene {
    /// Unique, fit for a file name; scenes of one kind begin alike.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: &'static str,
    /// Width and height of the window in pixels.
    pub size: (i32, i32),
    /// Console variables that are set before the renderer starts.
    pub cvars: &'static [(&'static str, &'static str)],
    /// Whether OpenArena's packs lie below the scene's own files.
    pub packs: bool,
    /// Its files, above [`textures::files`].
    pub files: fn() -> Vec<File>,
    /// The calls. Menus can be drawn already; no map is loaded.
    pub play: fn(&mut Stage) -> Result<(), Raised>,
    /// How alike the outcomes have to be.
    pub limit: Limit,
    /// Whether it is played by every run of the tests.
    pub quick: bool,
}

impl Scene {
    /// A scene of 640x480 without files of its own.
    pub const fn new(
        name: &'static str,
        about: &'static str,
        play: fn(&mut Stage) -> Result<(), Raised>,
    ) -> Self {
        Self {
            name,
            about,
            size: (640, 480),
            cvars: &[],
            packs: false,
            files: Vec::new,
            play,
            limit: Limit::SAME,
            quick: false,
        }
    }
}

/// A list of scenes in rows: the name, what it shows, what it draws, and fields other than those of [`Scene::new`]. A
/// scene draws a board at times, `board(board, times)`, or makes calls, `calls(function)`.
macro_rules! scene_list {
    ($($name:literal: $about:literal, $kind:ident($($what:expr),+) $(, $field:ident: $value:expr)*;)+) => {
        vec![$(Scene {
            $($field: $value,)*
            ..scene_list!(@$kind $name, $about, $($what),+)
        }),+]
    };
    (@board $name:literal, $about:literal, $board:expr, $times:expr) => {
        Scene {
            files: || $board.files(),
            ..Scene::new($name, $about, |stage| $board.play(stage, $times))
        }
    };
    (@calls $name:literal, $about:literal, $play:expr) => {
        Scene::new($name, $about, $play)
    };
}
use scene_list;

/// Every scene.
pub fn scenes() -> Vec<Scene> {
    let mut all = Vec::new();
    all.extend(calls::scenes());
    all.extend(entities::scenes());
    all.extend(models::scenes());
    all.extend(effects::scenes());
    all.extend(colors::scenes());
    all.extend(coordinates::scenes());
    all.extend(deforms::scenes());
    all.extend(stages::scenes());
    all.extend(images::scenes());
    all.extend(skies::scenes());
    all.extend(materials::scenes());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let mut names: Vec<&str> = scenes().iter().map(|s| s.name).collect();
        names.sort_unstable();
        let all = names.len();
        names.dedup();
        assert_eq!(names.len(), all);
        assert!(
            names
                .iter()
                .all(|n| n.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-'))
        );
    }
}
