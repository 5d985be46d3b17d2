//! How the scripts treat packs on their command line.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

/// Runs a line of shell with the scripts' common functions; `file` is its `$1`, `folder` its `$2`.
fn shell(line: &str, file: &Path, folder: &Path) -> Output {
    let common = tests::data::repository().join("scripts/common.sh");
    Command::new("bash")
        .args(["-c", &format!(". '{}'\n{line}", common.display()), "bash"])
        .args([file, folder])
        .env("GAME_DIR", folder)
        // bash warns of a locale that the machine lacks
        .env("LC_ALL", "C")
        .output()
        .expect("bash runs")
}

/// A pack with files of these names.
fn pack(file: &Path, names: &[&str]) {
    let mut pack = zip::ZipWriter::new(std::fs::File::create(file).expect("a file"));
    for name in names {
        pack.start_file(*name, zip::write::SimpleFileOptions::default())
            .expect("an entry");
        pack.write_all(b"anything").expect("written");
    }
    pack.finish().expect("a pack");
}

#[test]
fn a_pack_that_cannot_be_played_is_refused_with_a_remedy() {
    let root = tempfile::tempdir().expect("a folder");
    let at = |name: &str| root.path().join(name);
    let printed = |file: &Path| {
        let output = shell("check_pack \"$1\"", file, root.path());
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.success(), printed.is_empty(), "{printed}");
        printed
    };
    assert!(printed(&at("none.pk3")).contains("is its path right?"));
    assert!(printed(root.path()).contains("is no file"));
    std::fs::write(at("text.pk3"), "Rar!").expect("written");
    assert!(printed(&at("text.pk3")).contains("is no pack"));
    std::fs::write(at("empty.pk3"), "").expect("written");
    assert!(printed(&at("empty.pk3")).contains("is no pack"));
    pack(&at("textures.pk3"), &["textures/a.tga"]);
    assert!(printed(&at("textures.pk3")).contains("has no maps"));
    pack(&at("below.pk3"), &["my map/maps/a.bsp"]);
    assert!(printed(&at("below.pk3")).contains("has no maps where the game reads them"));
    pack(&at("good one.pk3"), &["maps/B.bsp", "maps/a-1.bsp"]);
    assert_eq!(printed(&at("good one.pk3")), "");
    let listed = shell("map_names \"$1\"", &at("good one.pk3"), root.path());
    assert_eq!(String::from_utf8_lossy(&listed.stdout), "a-1\nb\n");
}

#[test]
fn a_pack_is_added_to_the_game_without_a_change_to_its_folder() {
    let root = tempfile::tempdir().expect("a folder");
    let [game, given] = ["game/baseoa", "given"].map(|name| root.path().join(name));
    for folder in [&game, &given] {
        std::fs::create_dir_all(folder).expect("a folder");
    }
    pack(&game.join("z_last.pk3"), &["maps/a.bsp"]);
    let file = given.join("mine.pk3");
    pack(&file, &["maps/b.bsp"]);
    let folder = root.path().join("joined");
    let line = format!(
        "GAME_DIR='{}'\ngame_with \"$1\" \"$2\"\necho \"$GAME_DIR\"",
        root.path().join("game").display()
    );
    // twice: what an earlier run left is replaced
    for _ in 0..2 {
        let output = shell(&line, &file, &folder);
        assert!(output.status.success(), "{output:?}");
        let joined = String::from_utf8_lossy(&output.stdout);
        assert_eq!(joined.trim(), folder.display().to_string());
    }
    let names = |folder: &Path| {
        let entries = std::fs::read_dir(folder).expect("a folder");
        let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("an entry").file_name();
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    };
    assert_eq!(names(&game), ["z_last.pk3"]);
    let joined = folder.join("baseoa");
    // the engine reads packs in the order of their names, and the last one wins
    assert_eq!(names(&joined), ["z_last.pk3", "~given.pk3"]);
    let linked = std::fs::canonicalize(joined.join("~given.pk3")).expect("a link");
    assert_eq!(linked, std::fs::canonicalize(&file).expect("a file"));
}
