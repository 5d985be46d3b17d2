//! How the scripts treat packs on their command line, and the manifests of package managers.

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

#[test]
fn manifests_name_the_files_of_this_version() {
    let root = tests::data::repository();
    if !root.join(".git").exists() {
        return testkit::skip("this is no git checkout");
    }
    let out = tempfile::tempdir().expect("a folder");
    let out = out.path();
    let version = env!("CARGO_PKG_VERSION");
    let zip = format!("relight-{version}-windows-x86_64.zip");
    std::fs::write(out.join(&zip), "abc").expect("written");
    let output = Command::new(root.join("scripts/package"))
        .args(["--only", "source,manifests", "--out"])
        .arg(out)
        .args(["--repository", "https://github.com/some-one/relight"])
        .output()
        .expect("bash runs");
    assert!(output.status.success(), "{output:?}");
    let read = |file: &str| std::fs::read_to_string(out.join(file)).expect(file);
    // each file: what it must have, beside the address of the release's files
    let download = format!("https://github.com/some-one/relight/releases/download/v{version}");
    let source = format!("{download}/relight-{version}.tar.xz");
    let sums = read("SHA256SUMS");
    let sum_of = |file: &str| {
        let line = sums.lines().find(|l| l.ends_with(&format!("  {file}")));
        line.expect(file)[..64].to_owned()
    };
    let source_sum = sum_of(&format!("relight-{version}.tar.xz"));
    // FIPS 180-2, appendix B.1
    let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(sum_of(&zip), abc);
    let has = |file: &str, parts: &[&str]| {
        let text = read(file);
        for part in parts {
            assert!(text.contains(part), "{file} has no {part}:\n{text}");
        }
    };
    let pkgver = format!("pkgver={version}\n");
    has("aur/PKGBUILD", &[&pkgver, &source, &source_sum]);
    let app = "io.github.some_one.relight";
    let id = format!("id: {app}\n");
    has(&format!("flatpak/{app}.yml"), &[&id, &source, &source_sum]);
    let package = format!("PackageIdentifier: some-one.Relight\nPackageVersion: {version}\n");
    for file in ["", ".locale.en-US"] {
        has(&format!("winget/some-one.Relight{file}.yaml"), &[&package]);
    }
    let archive = format!("{download}/{zip}");
    has(
        "winget/some-one.Relight.installer.yaml",
        &[&package, &archive, abc],
    );

    let crates = read("flatpak/cargo-sources.json");
    let crates: serde_json::Value = serde_json::from_str(&crates).expect("JSON");
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).expect("Cargo.lock");
    // an archive and its checksum for cargo
    let sources = crates.as_array().map_or(0, Vec::len);
    assert_eq!(sources, 2 * lock.matches("\nchecksum = ").count());
}
