//! `relight material` on a made-up game folder.

use std::process::{Command, Output};

const SCRIPT: &str = "t/other\n{\n}\nt/lamp\n{\n\tsurfaceparm nolightmap\n\tq3map_surfacelight 255\n\tq3map_lightRGB 1 0 0\n\tcull nonsense\n\t{\n\t\tmap $whiteimage\n\t\tblendFunc add\n\t}\n}\nt/last\n{\n}\n";

fn material(arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("scripts")).unwrap();
    std::fs::write(folder.path().join("scripts/a.shader"), SCRIPT).unwrap();
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["material", "--game"])
        .arg(folder.path())
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn json_tells_stages_light_and_warnings_with_their_lines() {
    let output = material(&["T/Lamp", "--json"]);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let lamp = &json[0];
    assert_eq!(lamp["material"]["script"], "scripts/a.shader:4");
    assert_eq!(lamp["material"]["stages"].as_array().unwrap().len(), 1);
    assert_eq!(lamp["light"]["class"], "Translucent");
    assert_eq!(lamp["light"]["emission"]["source"], "surfacelight");
    let red = lamp["light"]["emission"]["strength"][0].as_f64().unwrap();
    assert!((red - std::f64::consts::PI).abs() < 1e-5);
    let warning = &lamp["warnings"][0];
    assert_eq!(
        (&warning["place"], &warning["line"]),
        (&"scripts/a.shader".into(), &9.into())
    );
    let source = lamp["source"].as_array().unwrap();
    assert_eq!(source.first().unwrap()["text"], "t/lamp");
    assert_eq!(source.last().unwrap()["number"], 14);
}

#[test]
fn people_see_the_line_that_is_warned_about() {
    let output = material(&["t/lamp"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for part in [
        "translucent",
        "surfacelight",
        "> ",
        "cull nonsense",
        "scripts/a.shader:9",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}

#[test]
fn what_is_missing_is_told_and_fails() {
    let output = material(&["t/nowhere"]);
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("neither a script nor an image"), "{text}");
}

#[test]
fn a_map_s_material_throws_back_as_much_as_its_picture() {
    let mut map = q3bsp::builder::MapBuilder::new();
    let wall = map.add_shader("t/grey", 0, 1);
    map.add_room(wall, glam::Vec3::splat(-128.0), glam::Vec3::splat(128.0));
    let folder = tempfile::tempdir().unwrap();
    let write = |path: &str, bytes: Vec<u8>| {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    };
    write("maps/m.bsp", map.build().write());
    let head = [0u8, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0];
    write("t/grey.tga", [&head[..], &[188; 3]].concat());
    let albedo = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["material", "t/grey", "--json", "--game"])
            .arg(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json[0]["light"]["albedo"][0].as_f64().unwrap()
    };
    let alone = albedo(&["--lighting", "vertex"]);
    let used = albedo(&["--map", "m"]);
    assert!((alone - 0.5).abs() < 0.02, "{alone}");
    assert!((used - alone).abs() < 1e-3, "{used} for {alone}");
}

#[test]
fn a_fault_of_a_whole_script_is_told_with_its_place_and_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("scripts")).unwrap();
    let script = "t/lamp\n{\n\t{\n\t\tmap $whiteimage\n\t}\n}\n/* lamps:\nt/lost\n{\n}\n";
    std::fs::write(folder.path().join("scripts/a.shader"), script).unwrap();
    std::fs::write(folder.path().join("scripts/b.shader"), "t/open\n{\n").unwrap();
    let printed = |command: &str, name: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_relight"))
            .args([command, name, "--game"])
            .arg(folder.path())
            .output()
            .unwrap();
        String::from_utf8(output.stderr).unwrap()
    };
    for text in [printed("material", "t/lamp"), printed("info", "nowhere")] {
        let place = "scripts/a.shader:7:1: warning: this comment is never closed";
        assert!(text.contains(place) && text.contains("put */"), "{text}");
        assert!(text.contains("scripts/b.shader:1:1: error"), "{text}");
    }
}
