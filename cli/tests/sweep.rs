//! Maps of all formats, cut off at many places and filled with noise, through every command that reads maps: exit code 2
//! and one sentence, or 0 where what is missing is not needed; never a file half written.

mod common;

use common::{map, relight};
use q3bsp::Format;
use testkit::Random;

const COMMANDS: [&[&str]; 8] = [
    &["info", "bad.bsp"],
    &["convert", "bad.bsp", "-o", "out.glb"],
    &["convert", "bad.bsp", "-o", "out.gltf"],
    &["convert", "bad.bsp", "-o", "out.obj"],
    &["convert", "bad.bsp", "-o", "out.map"],
    &["convert", "bad.bsp", "-o", "out.json"],
    &["lights", "bad.bsp", "-o", "out.png"],
    &["render", "bad.bsp", "-o", "out.png"],
];

/// The sentence of a command about a file that it refuses; `None` where it takes it.
fn refusal(bytes: &[u8], arguments: &[&str], what: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.bsp"), bytes).unwrap();
    let output = relight(folder.path(), arguments);
    let text = String::from_utf8_lossy(&output.stderr)
        .trim_end()
        .to_owned();
    match output.status.code() {
        Some(0) => return None,
        Some(2) => {}
        code => panic!("{what}: {arguments:?}: {code:?}: {text}"),
    }
    assert_eq!(text.lines().count(), 1, "{what}: {arguments:?}: {text}");
    assert!(text.contains("bad.bsp"), "{what}: {text}");
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 1, "{what}: {arguments:?}: files were left behind");
    Some(text)
}

#[test]
fn maps_cut_off_anywhere_are_refused_with_the_place() {
    for format in [
        Format::Ibsp46,
        Format::Ibsp47,
        Format::QuakeLive,
        Format::Rbsp,
        Format::Fbsp,
    ] {
        let whole = map(format);
        assert_eq!(refusal(&whole, COMMANDS[0], "whole"), None);
        // lumps are long: what is cut is mostly a lump's middle
        for (step, arguments) in (0..24).zip(COMMANDS.iter().cycle()) {
            let end = whole.len() * step / 24;
            let what = format!("{format:?} cut at {end} of {}", whole.len());
            let text = refusal(&whole[..end], arguments, &what);
            let text = text.unwrap_or_else(|| panic!("{what}: {arguments:?} takes it"));
            let place = text.contains("offset") || text.contains("bytes");
            assert!(place, "{what}: {text}");
        }
    }
}

#[test]
fn noise_in_a_map_is_refused_or_harmless() {
    let whole = map(Format::Ibsp46);
    let mut refused = 0;
    for (seed, arguments) in (1..=40).zip(COMMANDS.iter().cycle()) {
        let mut bytes = whole.clone();
        // drawing needs a map that is one
        if arguments.first() == Some(&"render") || arguments.first() == Some(&"lights") {
            continue;
        }
        let mut random = Random::new(seed);
        let at = 8 + (random.bytes(1)[0] as usize) * (whole.len() - 80) / 255;
        bytes[at..at + 64].copy_from_slice(&random.bytes(64));
        let what = format!("noise {seed} at {at}");
        refused += usize::from(refusal(&bytes, arguments, &what).is_some());
    }
    assert!(refused > 2, "{refused}");
}

#[test]
fn what_is_no_map_is_refused_by_every_command() {
    let headers: [&[u8]; 5] = [b"IBSP", b"RBSP", b"FBSP", b"BSP2", b"\x1d\0\0\0"];
    for (seed, header) in (1..).zip(headers) {
        let bytes = [header, &Random::new(seed).bytes(3000)].concat();
        for arguments in COMMANDS {
            let what = format!("{header:?} and noise");
            let text = refusal(&bytes, arguments, &what);
            assert!(text.is_some(), "{what}: {arguments:?} takes it");
        }
    }
    for bytes in [&[][..], &[0; 4], &[0; 5000], &Random::new(9).bytes(5000)] {
        for arguments in COMMANDS {
            let what = format!("{} bytes", bytes.len());
            let text = refusal(bytes, arguments, &what);
            assert!(text.is_some(), "{what}: {arguments:?} takes it");
        }
    }
}

#[test]
fn a_map_that_is_nowhere_is_refused_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in COMMANDS {
        let named: Vec<&str> = arguments
            .iter()
            .map(|a| if *a == "bad.bsp" { "nowhere" } else { a })
            .collect();
        let output = relight(folder.path(), &named);
        assert_eq!(output.status.code(), Some(2), "{named:?}: {output:?}");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(text.trim_end().lines().count(), 1, "{named:?}: {text}");
    }
}
