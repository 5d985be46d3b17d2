//! Files that are no maps, or damaged ones: one sentence with the place, exit code 2, nothing written.

mod common;

use common::{map, relight, run};
use q3bsp::{Bsp, Format, Lump};
use std::process::Command;
use testkit::Random;

/// Every command that reads maps, on one file: the code, and the one line about it.
fn error(bytes: &[u8]) -> String {
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
        let cut = error(&whole[..vertices.offset as usize + 10]);
        assert!(
            cut.contains("offset") && cut.contains("outside the file of"),
            "{cut}"
        );
    }
    assert!(error(&map(Format::Ibsp46)[..50]).contains("50 bytes"));
    assert!(error(b"").contains("0 bytes"));
}

#[test]
fn a_wrong_reference_names_lump_and_offset() {
    let mut bytes = map(Format::Fbsp);
    let bsp = Bsp::parse(&bytes).unwrap();
    let at = bsp.container.lumps[Lump::Surfaces.index()].offset as usize + 148;
    bytes[at..at + 4].copy_from_slice(&999i32.to_le_bytes());
    let text = error(&bytes);
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
        let text = error(bytes);
        assert!(text.contains(part), "{part}: {text}");
    }
    error(&Random::new(1).bytes(5000));
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

/// Messages of a program about a command that it refuses, in an empty folder.
fn refused(program: &str, arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = run(program, folder.path(), arguments);
    assert!(!output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    const RENDER: &[&str] = &["render", "m", "-o", "out.png"];
    const CONVERT: &[&str] = &["convert", "m", "-o", "out.glb"];
    for (command, option, number, part) in [
        (RENDER, "--fov", "0", "from 1 to 170 degrees"),
        (RENDER, "--fov", "180", "from 1 to 170 degrees"),
        (RENDER, "--fov", "NaN", "from 1 to 170 degrees"),
        (RENDER, "--spp", "0", "0 is not in 1.."),
        (RENDER, "--frames", "0", "0 is not in 1.."),
        (RENDER, "--shutter", "1.5", "from 0 to 1"),
        (RENDER, "--candidates", "0", "from 1 to 64"),
        (RENDER, "--bounces", "17", "from 0 to 16"),
        (RENDER, "--denoiser", "3", "from 0 to 2"),
        (RENDER, "--size", "0x10", "WIDTHxHEIGHT"),
        (RENDER, "--exposure", "NaN", "a number"),
        (
            RENDER,
            "--tracer",
            "gpu",
            "one of auto, pipeline, query, compute",
        ),
        (RENDER, "--set", "rt_maxDepth=17", "from 0 to 16"),
        (RENDER, "--set", "rt_maxDepth", "NAME=VALUE"),
        (RENDER, "--set", "rt_depth=1", "no setting rt_depth"),
        (RENDER, "--time", "inf", "a number"),
        (RENDER, "--render-scale", "0.1", "from 0.25 to 1"),
        (RENDER, "--render-scale", "inf", "from 0.25 to 1"),
        (CONVERT, "--scale", "0", "above 0"),
        (CONVERT, "--light-scale", "inf", "above 0"),
        (CONVERT, "--subdivisions", "NaN", "above 0"),
        (&["cameras"], "--every", "0", "of at least 1"),
        (&["cameras"], "--views", "0", "of at least 1"),
        (RENDER, "--view", "0,0,NaN,0", "X,Y,Z,YAW,PITCH"),
        (RENDER, "--step", "0,0,inf,0", "X,Y,Z,YAW"),
        (RENDER, "--step", "1,2,3", "X,Y,Z,YAW"),
        (RENDER, "--lens", "NaN,100", "numbers above 0"),
        (RENDER, "--lens", "4,0", "numbers above 0"),
    ] {
        refused_option(env!("CARGO_BIN_EXE_relight"), command, option, number, part);
    }
    for (command, option, number, part) in [
        ("measure", "--fov", "180", "from 1 to 170 degrees"),
        ("measure", "--frames", "1", "1 is not in 2.."),
        ("measure", "--views", "0", "of at least 1"),
        ("estimators", "--candidates", "0", "from 1 to 64"),
        ("estimators", "--view", "0,0", "X,Y,Z,YAW,PITCH"),
        ("light-lists", "--rays", "0", "0 is not in 1.."),
        ("light-lists", "--clusters", "0", "of at least 1"),
        ("tracers", "--made", "13", "13 is not in 14.."),
        ("tracers", "--tracer", "grid=257", "grid=CELLS"),
        ("looks", "--views", "0", "of at least 1"),
        ("looks", "--frames", "0", "0 is not in 1.."),
    ] {
        let lab = env!("CARGO_BIN_EXE_relight-lab");
        refused_option(lab, &[command, "m"], option, number, part);
    }
}

/// Checks that a program refuses a value of an option, by the option's name and with what it takes.
fn refused_option(program: &str, command: &[&str], option: &str, value: &str, part: &str) {
    let arguments = [command, &[option, value]].concat();
    let text = refused(program, &arguments);
    assert!(
        text.contains(option) && text.contains(part),
        "{arguments:?}: {text}"
    );
}

#[test]
fn a_pack_with_everything_below_one_folder_names_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let pack = |name: &str, inside: &str| {
        let file = std::fs::File::create(folder.path().join(name)).unwrap();
        let mut zip = zip::ZipWriter::new(file);
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file(inside, options).unwrap();
        std::io::Write::write_all(&mut zip, &map(Format::Ibsp46)).unwrap();
        zip.finish().unwrap();
    };
    pack("deep.pk3", "MyMap/Maps/x.bsp");
    pack("flat.pk3", "x.bsp");
    pack("none.pk3", "readme.txt");
    std::fs::create_dir(folder.path().join("game")).unwrap();
    for command in [
        &["convert", "PACK", "-o", "out"][..],
        &["info", "PACK"],
        &["render", "PACK", "-o", "out.png"],
    ] {
        let error = |pack: &str| {
            let words = command.iter().map(|w| if *w == "PACK" { pack } else { w });
            let output = Command::new(env!("CARGO_BIN_EXE_relight"))
                .current_dir(folder.path())
                .args(words)
                .args(["--game", "game"])
                .output()
                .unwrap();
            assert!(!output.status.success(), "{command:?}: {output:?}");
            String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
        };
        let deep = error("deep.pk3");
        let named = deep.contains("below the folder MyMap (MyMap/Maps/x.bsp)");
        assert!(
            named && deep.contains("pack what is inside of MyMap"),
            "{deep}"
        );
        let flat = error("flat.pk3");
        assert!(flat.contains("x.bsp is in no folder maps"), "{flat}");
        assert!(error("none.pk3").contains("no maps in it"));
    }
}

#[test]
fn a_missing_denoiser_is_reported_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |more: &[&str]| {
        let usual = ["render", "--sample", "-o", "out.png", "--denoise", "oidn"];
        let output = relight(folder.path(), &[&usual, more].concat());
        assert_eq!(output.status.code(), Some(1), "{more:?}: {output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let text = refused(&["--oidn", "nowhere/libOpenImageDenoise.so.2"]);
    assert_eq!(text.lines().count(), 1, "{text}");
    for part in ["install it", "--oidn", "nowhere/libOpenImageDenoise.so.2: "] {
        assert!(text.contains(part), "{text}");
    }
    // refused before the library is looked for
    let wrong = |more: &[&str], part: &str| {
        let text = refused(more);
        assert!(text.contains(part), "{text}");
    };
    wrong(&["--look", "classic"], "traced look");
    wrong(&["--render-scale", "0.5"], "--render-scale 1");
    wrong(&["--debug", "1"], "rt_debug 0");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn devices_that_cannot_share_a_picture_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, part) in [
        (&["--look", "classic"][..], "traced look"),
        (&["--render-scale", "0.5"], "--render-scale 1"),
        (&["--debug", "1"], "rt_debug 0"),
        (&["--step", "4,0,0,0"], "a --step needs a --shutter"),
        (&["--spp", "1"], "more devices than frames"),
    ] {
        let usual = ["render", "--sample", "-o", "out.png", "--devices", "0,0"];
        let output = relight(folder.path(), &[&usual, more].concat());
        assert_eq!(output.status.code(), Some(1), "{more:?}: {output:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
