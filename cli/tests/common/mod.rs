//! What tests of the program share: a map of one room, and the program in a folder of its own.

use glam::Vec3;
use q3bsp::Format;
use q3bsp::builder::MapBuilder;
use std::path::Path;
use std::process::{Command, Output};

/// A room without lights, as a file of a format.
pub fn map(format: Format) -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let mut bsp = map.build();
    bsp.format = format;
    bsp.write()
}

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
