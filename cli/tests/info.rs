//! `relight info` on a made-up game folder.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use std::path::Path;
use std::process::{Command, Output};

fn map() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/missing", 0, 1);
    let lamp = map.add_shader("t/lamp", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    map.add_quad(
        lamp,
        [(-8.0, -8.0), (8.0, -8.0), (8.0, 8.0), (-8.0, 8.0)].map(|(x, y)| Vec3::new(x, y, 100.0)),
    );
    map.build().write()
}

fn game(folder: &Path) {
    let script = "t/lamp\n{\nq3map_lightRGB 1 0 0\nq3map_surfacelight 255\n{\nmap *white\n}\n}\n";
    std::fs::create_dir_all(folder.join("scripts")).unwrap();
    std::fs::create_dir_all(folder.join("maps")).unwrap();
    std::fs::write(folder.join("scripts/a.shader"), script).unwrap();
    std::fs::write(folder.join("maps/room.bsp"), map()).unwrap();
}

fn info(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .arg("info")
        .arg("--game")
        .arg(folder)
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn json_tells_lights_and_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    game(folder.path());
    let output = info(folder.path(), &["--json"]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let room = &json["maps"][0];
    assert_eq!(room["map"], "maps/room.bsp");
    assert_eq!(room["triangle_lights"], 2);
    assert_eq!(room["lights_by_source"]["surfacelight"], 2);
    assert_eq!(room["missing"][0], "t/missing");
    assert_eq!(room["emitters"][0]["material"], "t/lamp");
    let red = room["emitters"][0]["radiance"][0].as_f64().unwrap();
    assert!((red - std::f64::consts::PI).abs() < 1e-5);
    assert_eq!(json["failures"].as_array().unwrap().len(), 0);
}

#[test]
fn a_broken_map_is_told_and_the_others_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    game(folder.path());
    let broken = folder.path().join("broken.bsp");
    std::fs::write(&broken, "IBSP").unwrap();
    let output = info(
        folder.path(),
        &["room", broken.to_str().unwrap(), "nowhere"],
    );
    assert!(!output.status.success());
    let (table, errors) = (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    );
    assert!(
        table.contains("maps/room.bsp") && table.contains("missing: t/missing"),
        "{table}"
    );
    assert!(
        errors.contains("broken.bsp") && errors.contains("nowhere: "),
        "{errors}"
    );
}

#[test]
fn no_game_folder_is_one_sentence() {
    let output = info(Path::new("/nonexistent/game"), &[]);
    assert!(!output.status.success());
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("/nonexistent/game")
    );
}

/// A picture of `side` texels of one grey.
fn tga(side: u8, grey: u8) -> Vec<u8> {
    let header = [
        0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, side, 0, side, 0, 24, 0x20,
    ];
    let texels = vec![grey; usize::from(side) * usize::from(side) * 3];
    [header.to_vec(), texels].concat()
}

#[test]
fn lightmaps_beside_a_map_are_its_lightmaps() {
    let folder = tempfile::tempdir().unwrap();
    let mut bsp = q3bsp::Bsp::parse(&map()).unwrap();
    bsp.lightmaps.clear();
    bsp.surfaces.iter_mut().for_each(|s| s.lightmap = 0);
    // in the game, and as a file of its own elsewhere
    let (game, own) = (folder.path().join("game"), folder.path().join("own"));
    let stems = [game.join("maps/room"), own.join("room")];
    for stem in &stems {
        std::fs::create_dir_all(stem).unwrap();
        std::fs::write(stem.with_extension("bsp"), bsp.write()).unwrap();
        std::fs::write(stem.join("lm_0000.tga"), tga(16, 90)).unwrap();
    }
    let file = stems[1].with_extension("bsp");
    std::fs::create_dir_all(folder.path().join("empty")).unwrap();
    for (game, name) in [
        (game.as_path(), "room"),
        (&folder.path().join("empty"), file.to_str().unwrap()),
    ] {
        let output = info(game, &[name, "--json"]);
        assert!(output.status.success(), "{output:?}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let lightmaps = &json["maps"][0]["lightmaps"];
        assert_eq!(lightmaps["beside"], true, "{name}");
        assert_eq!(lightmaps["pages"], 1);
        assert_eq!(lightmaps["size"], 16);
        assert!(lightmaps["surfaces_with_page"].as_u64().unwrap() > 0);
    }
}

#[test]
fn a_game_may_be_one_pack() {
    let folder = tempfile::tempdir().unwrap();
    let pack = folder.path().join("room.pk3");
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&pack).unwrap());
    let options = zip::write::SimpleFileOptions::default();
    zip.start_file("maps/room.bsp", options).unwrap();
    std::io::Write::write_all(&mut zip, &map()).unwrap();
    zip.finish().unwrap();
    let output = info(&pack, &["--json"]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["maps"][0]["map"], "maps/room.bsp");
}
