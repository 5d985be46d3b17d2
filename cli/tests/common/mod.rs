//! What tests of the program share: a map of one room, and the program in a folder of its own.

mod map;

pub use map::map;
use std::path::Path;
use std::process::{Command, Output};

/// Runs `relight` in a folder that is its game, too.
pub fn relight(folder: &Path, arguments: &[&str]) -> Output {
    run(env!("CARGO_BIN_EXE_relight"), folder, arguments)
}

/// Runs a program in a folder that is its game, too.
pub fn run(program: &str, folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program)
        .current_dir(folder)
        .args(arguments)
        .args(["--game", "."])
        .output()
        .unwrap()
}
