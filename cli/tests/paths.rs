//! Names of folders and files in any script, and of any length.

#[path = "common/map.rs"]
mod map;

use map::map;
use q3bsp::Format;
use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::process::{Command, Output};

fn relight(arguments: &[&OsStr]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_relight"));
    command.args(arguments).output().unwrap()
}

/// Reads a map from a folder and writes it there in every format.
fn assert_usable(folder: &Path) {
    let maps = folder.join("maps");
    std::fs::create_dir_all(&maps).unwrap();
    let file = maps.join("räum 雷.bsp");
    std::fs::write(&file, map(Format::Ibsp46)).unwrap();
    let (game, output) = (OsStr::new("--game"), OsStr::new("-o"));
    let info = relight(&["info".as_ref(), file.as_ref(), game, folder.as_ref()]);
    assert!(info.status.success(), "{}: {info:?}", folder.display());
    for name in ["raum.glb", "räum.gltf", "雷.obj", "räum.map", "räum.json"] {
        for source in [file.as_os_str(), "räum 雷".as_ref()] {
            let written = folder.join("Ausgänge").join(name);
            let arguments = ["convert".as_ref(), source, game, folder.as_ref(), output];
            let done = relight(&[&arguments[..], &[written.as_ref()]].concat());
            assert!(done.status.success(), "{}: {done:?}", written.display());
            assert!(std::fs::metadata(&written).unwrap().len() > 0);
            std::fs::remove_file(&written).unwrap();
        }
    }
    let picture = folder.join("Lichter 灯.png");
    let arguments = [
        "lights".as_ref(),
        file.as_ref(),
        game,
        folder.as_ref(),
        output,
    ];
    let done = relight(&[&arguments[..], &[picture.as_ref()]].concat());
    assert!(done.status.success(), "{done:?}");
    let compared = relight(&["compare".as_ref(), picture.as_ref(), picture.as_ref()]);
    assert!(compared.status.success(), "{compared:?}");
}

#[test]
fn names_outside_ascii_are_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    assert_usable(&folder.path().join("Ünïcødé 雷 и"));
}

#[test]
fn paths_longer_than_windows_short_ones_are_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut long = folder.path().to_owned();
    for _ in 0..6 {
        long.push("ö".repeat(60));
    }
    assert_usable(&long);
    if cfg!(windows) {
        // as programs pass such paths on
        let mut verbatim = OsString::from(r"\\?\");
        verbatim.push(&long);
        assert_usable(Path::new(&verbatim));
    }
}

#[test]
fn arguments_that_are_no_text_are_named() {
    #[cfg(unix)]
    let odd: OsString = std::os::unix::ffi::OsStringExt::from_vec(b"--\xff".to_vec());
    #[cfg(windows)]
    let odd: OsString = std::os::windows::ffi::OsStringExt::from_wide(&[45, 45, 0xd800]);
    for arguments in [&[odd.as_os_str()][..], &["info".as_ref(), &odd]] {
        let output = relight(arguments);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(text.contains("unexpected argument '--\u{fffd}"), "{text}");
    }
}
