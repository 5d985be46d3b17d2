//! `relight convert` on a made-up game folder: what is written, and what bad maps come to.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use std::path::Path;
use std::process::{Command, Output};

fn map() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    map.build().write()
}

fn game(folder: &Path) {
    std::fs::create_dir_all(folder.join("maps")).unwrap();
    for name in ["room", "hall"] {
        std::fs::write(folder.join(format!("maps/{name}.bsp")), map()).unwrap();
    }
}

fn convert(game: &Path, output: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .arg("convert")
        .arg("--game")
        .arg(game)
        .arg("-o")
        .arg(output)
        .args(arguments)
        .output()
        .unwrap()
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn one_map_is_a_file_and_several_are_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    game(folder.path());
    let out = folder.path().join("out");
    let one = convert(folder.path(), &out.join("x.gltf"), &["room"]);
    assert!(one.status.success(), "{one:?}");
    assert_eq!(files(&out), ["images", "x.bin", "x.gltf"]);
    let out = folder.path().join("all");
    let all = convert(folder.path(), &out, &["room", "hall", "--json"]);
    assert!(all.status.success(), "{all:?}");
    assert_eq!(files(&out), ["hall.glb", "room.glb"]);
    let json: serde_json::Value = serde_json::from_slice(&all.stdout).unwrap();
    assert_eq!(json["converted"][0]["triangles"], 12);
}

#[test]
fn bad_maps_are_one_sentence_each_and_the_others_are_written() {
    let folder = tempfile::tempdir().unwrap();
    game(folder.path());
    let good = map();
    let cut = folder.path().join("cut.bsp");
    std::fs::write(&cut, &good[..good.len() / 2]).unwrap();
    let foreign = folder.path().join("foreign.bsp");
    std::fs::write(&foreign, [b'x'; 4096]).unwrap();
    let out = folder.path().join("out");
    let arguments = [cut.to_str().unwrap(), "room", foreign.to_str().unwrap()];
    let output = convert(folder.path(), &out, &arguments);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(files(&out), ["room.glb"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    // the room's wall has no image here; what is left is about the maps
    let (materials, lines): (Vec<_>, Vec<_>) =
        errors.lines().partition(|l| l.starts_with("material "));
    assert_eq!(materials.len(), 1, "{errors}");
    assert!(materials[0].contains("t/wall"), "{errors}");
    assert_eq!(lines.len(), 2, "{errors}");
    assert!(
        lines[0].contains("cut.bsp") && lines[0].contains("lump") && lines[0].contains("offset"),
        "{errors}"
    );
    assert!(lines[1].contains("foreign.bsp"), "{errors}");
}

#[test]
fn a_map_that_is_nowhere_is_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    game(folder.path());
    let out = folder.path().join("out");
    let output = convert(folder.path(), &out, &["nowhere"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("nowhere")
    );
    assert!(!out.exists());
}
