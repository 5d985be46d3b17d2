//! Every command on a whole map of every format that is read; the slowest on one of each family.

#[allow(dead_code)] // other tests need more of it
#[path = "../../q3bsp/tests/quake/room.rs"]
mod room;

mod common;

use common::{map, relight};
use q3bsp::Format;
use std::path::Path;

/// A map of each format, by its name.
fn maps() -> Vec<(String, Vec<u8>)> {
    let own = [
        Format::Ibsp46,
        Format::Ibsp47,
        Format::QuakeLive,
        Format::Rbsp,
        Format::Fbsp,
    ];
    let own = own.map(|format| (format!("{format:?}"), map(format)));
    let quake = room::FORMATS.map(|format| (format!("{format:?}"), room::room(format).write()));
    own.into_iter().chain(quake).collect()
}

/// Colours of a game that has no map of its own: the formats that need a palette take it from there.
fn game(folder: &Path) {
    std::fs::create_dir_all(folder.join("gfx")).unwrap();
    let palette: Vec<u8> = (0..768).map(|at| (at / 3) as u8).collect();
    std::fs::write(folder.join("gfx/palette.lmp"), palette).unwrap();
}

#[test]
fn every_command_takes_every_format() {
    for (name, bytes) in maps() {
        let folder = tempfile::tempdir().unwrap();
        game(folder.path());
        std::fs::write(folder.path().join("m.bsp"), bytes).unwrap();
        let slow = ["Rbsp", "Bsp2", "Quake2"].contains(&name.as_str());
        for (arguments, written) in [
            (&["info", "m.bsp"][..], None),
            (&["convert", "m.bsp", "-o", "m.glb"], Some("m.glb")),
            (&["convert", "m.bsp", "-o", "m.gltf"], Some("m.bin")),
            (&["convert", "m.bsp", "-o", "m.obj"], Some("m.mtl")),
            (&["convert", "m.bsp", "-o", "m.map"], Some("m.map")),
            (&["convert", "m.bsp", "-o", "m.json"], Some("m.json")),
            (
                &["lights", "m.bsp", "-o", "m.svg", "--no-calibration"],
                Some("m.svg"),
            ),
        ] {
            if arguments.first() == Some(&"lights") && !slow {
                continue;
            }
            let output = relight(folder.path(), arguments);
            assert!(output.status.success(), "{name} {arguments:?}: {output:?}");
            if let Some(written) = written {
                let size = std::fs::metadata(folder.path().join(written))
                    .unwrap()
                    .len();
                assert!(size > 40, "{name} {written}: {size} bytes");
            }
        }
        if let Some((sky, flags)) = match name.as_str() {
            "Quake" => Some(("textures/sky4", 4)),
            "Quake2" => Some(("textures/e1/sky", 4)),
            _ => None,
        } {
            // No script defines the map's materials.
            let output = relight(
                folder.path(),
                &["material", "--map", "m.bsp", sky, "--json"],
            );
            let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            let found = printed[0]["material"]["surfaceFlags"].as_u64().unwrap();
            assert_eq!(found & 4, flags, "{name}: {printed}");
        }
        if name == "Quake" {
            let of_map = ["material", "--map", "m.bsp", "textures/*lava1", "--json"];
            let output = relight(folder.path(), &of_map);
            assert!(output.status.success(), "{output:?}");
            let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            let stage = &printed[0]["material"]["stages"][1];
            assert_eq!(stage["map"], "textures/*lava1", "{printed}");
            let alone = relight(folder.path(), &["material", "textures/*lava1"]);
            assert_eq!(alone.status.code(), Some(1), "{alone:?}");
        }
        let output = relight(
            folder.path(),
            &["convert", "m.bsp", "-o", "m.glb", "--json"],
        );
        let printed: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        // the rooms of Quake's formats have a window to the sky
        let quake = room::FORMATS.iter().any(|f| format!("{f:?}") == name);
        let triangles = if quake { 10 } else { 12 };
        assert_eq!(printed["converted"][0]["triangles"], triangles, "{name}");
    }
}
