//! Files that are no maps, or damaged ones: one sentence that says where, exit code 2, nothing written.

mod common;

use common::{map, relight};
use q3bsp::{Bsp, Format, Lump};

/// Every command that reads maps, on one file: the code, and the one line about it.
fn told(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.bsp"), bytes).unwrap();
    let mut lines = Vec::new();
    for arguments in [
        &["info", "bad.bsp"][..],
        &["convert", "bad.bsp", "-o", "out.json"],
        &["convert", "bad.bsp", "-o", "out.glb"],
        &["lights", "bad.bsp", "-o", "out.png"],
        &["render", "bad.bsp", "-o", "out.png"],
    ] {
        let output = relight(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {output:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        let text = text.trim_end();
        assert_eq!(text.lines().count(), 1, "{arguments:?}: {text}");
        assert!(text.contains("bad.bsp"), "{text}");
        lines.push(text.to_owned());
    }
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 1, "files were left behind");
    lines.concat()
}

#[test]
fn a_map_that_is_cut_off_names_lump_and_offset() {
    for format in [Format::Ibsp46, Format::Rbsp] {
        let whole = map(format);
        let bsp = Bsp::parse(&whole).unwrap();
        let vertices = bsp.container.lumps[Lump::DrawVerts.index()];
        let cut = told(&whole[..vertices.offset as usize + 10]);
        assert!(
            cut.contains("offset") && cut.contains("outside the file of"),
            "{cut}"
        );
    }
    assert!(told(&map(Format::Ibsp46)[..50]).contains("50 bytes"));
    assert!(told(b"").contains("0 bytes"));
}

#[test]
fn a_wrong_reference_names_lump_and_offset() {
    let mut bytes = map(Format::Fbsp);
    let bsp = Bsp::parse(&bytes).unwrap();
    let at = bsp.container.lumps[Lump::Surfaces.index()].offset as usize + 148;
    bytes[at..at + 4].copy_from_slice(&999i32.to_le_bytes());
    let text = told(&bytes);
    assert!(
        text.contains("lump surfaces, element 1: shaderNum is 999"),
        "{text}"
    );
    assert!(
        text.contains(&format!("at byte {at} of the file")),
        "{text}"
    );
}

#[test]
fn foreign_and_random_files_are_told() {
    for (bytes, part) in [
        (&b"VBSP\x14\0\0\0 and so on"[..], "Source"),
        (b"PK\x03\x04 and so on", "zip"),
        (b"\x89PNG\r\n\x1a\n", "unknown"),
    ] {
        let text = told(bytes);
        assert!(text.contains(part), "{part}: {text}");
    }
    let mut state = 1u32;
    let noise: Vec<u8> = (0..5000)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
        .collect();
    told(&noise);
}

#[test]
fn maps_become_json_and_map_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("good.bsp"), map(Format::Ibsp47)).unwrap();
    for (name, part) in [
        ("out.json", "\"relight-map\""),
        ("out.map", "\"worldspawn\""),
    ] {
        let output = relight(folder.path(), &["convert", "good.bsp", "-o", name]);
        assert!(output.status.success(), "{output:?}");
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(text.contains(part), "{name}");
    }
}
