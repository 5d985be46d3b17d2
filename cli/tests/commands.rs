//! What the two commands offer, and what they say to spellings of earlier versions.

use std::process::{Command, Output};

const RELIGHT: &str = env!("CARGO_BIN_EXE_relight");
const LAB: &str = env!("CARGO_BIN_EXE_relight-lab");

fn output(program: &str, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).output().unwrap()
}

/// The subcommands that a program's help lists.
fn listed(program: &str) -> Vec<String> {
    let help = output(program, &["--help"]);
    assert!(help.status.success(), "{help:?}");
    let text = String::from_utf8(help.stdout).unwrap();
    let list = text
        .split("Commands:\n")
        .nth(1)
        .expect("a list of commands");
    let rows = list.lines().take_while(|line| line.starts_with("  "));
    rows.filter_map(|row| row.split_whitespace().next())
        .map(str::to_owned)
        .collect()
}

#[test]
fn help_lists_the_commands_of_users_and_those_of_the_lab_apart() {
    let users = [
        "bake",
        "calibration",
        "cameras",
        "compare",
        "convert",
        "info",
        "lights",
        "material",
        "render",
        "report",
        "sample",
        "view",
        "watch",
        "help",
    ];
    assert_eq!(listed(RELIGHT), users);
    let lab = [
        "agreement",
        "bodies",
        "curves",
        "estimators",
        "growth",
        "light-lists",
        "looks",
        "measure",
        "tracers",
        "help",
    ];
    assert_eq!(listed(LAB), lab);
}

#[test]
fn replaced_spellings_are_refused_with_the_new_one() {
    const RENDER: [&str; 4] = ["render", "m", "-o", "m.png"];
    let render = |option: &[&'static str]| [&RENDER, option].concat();
    for (program, arguments, printed) in [
        (
            RELIGHT,
            render(&["--classic"]),
            "relight render --classic is now --look classic",
        ),
        (
            RELIGHT,
            render(&["--traced"]),
            "relight render --traced is now --look traced",
        ),
        (
            RELIGHT,
            render(&["--camera", "0", "-1", "2", "90", "-5"]),
            "relight render --camera is now --view X,Y,Z,YAW,PITCH",
        ),
        (
            RELIGHT,
            render(&["--scale=0.5"]),
            "relight render --scale is now --render-scale",
        ),
        (
            RELIGHT,
            render(&["--step", "1", "-2", "3", "4"]),
            "relight render --step is now --step X,Y,Z,YAW",
        ),
        (
            RELIGHT,
            render(&["--lens", "4", "100"]),
            "relight render --lens is now --lens DIAMETER,DISTANCE",
        ),
        (
            RELIGHT,
            vec!["convert", "m", "-o", "m.glb", "--exposure", "2"],
            "relight convert --exposure is now --light-scale",
        ),
        (
            RELIGHT,
            vec!["cameras", "--each", "1"],
            "relight cameras --each is now --views",
        ),
        (
            RELIGHT,
            vec!["lights", "m", "--judge", "--rays", "256"],
            "relight lights --judge is now relight-lab light-lists",
        ),
        (
            RELIGHT,
            vec!["lights", "m", "--picture", "m.svg"],
            "relight lights --picture is now --output",
        ),
        (
            RELIGHT,
            vec!["looks", "m"],
            "relight looks is now relight-lab looks",
        ),
        (
            RELIGHT,
            vec!["measure", "m"],
            "relight measure is now relight-lab measure",
        ),
        (
            RELIGHT,
            vec!["estimators", "m"],
            "relight estimators is now relight-lab estimators",
        ),
        (
            LAB,
            vec!["estimators", "m", "--camera", "0", "0", "0", "0"],
            "relight-lab estimators --camera is now --view X,Y,Z,YAW,PITCH",
        ),
        (
            LAB,
            vec!["measure", "m", "--each", "1"],
            "relight-lab measure --each is now --views",
        ),
    ] {
        let refused = output(program, &arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {refused:?}");
        let text = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(text, format!("error: {printed}\n"), "{arguments:?}");
    }
}

#[test]
fn what_was_never_there_is_refused_by_its_name() {
    for (arguments, printed) in [
        (
            &["render", "m", "-o", "m.png", "--nothing"][..],
            "'--nothing'",
        ),
        // an option of another subcommand, and a value like one that was replaced
        (&["info", "--classic"], "'--classic'"),
        (&["nothing"], "'nothing'"),
        (
            &["render", "m", "-o", "m.png", "--look", "nothing"],
            "classic, traced",
        ),
        (&["render", "m", "-o", "m.png", "--frames", "9"], "--spp"),
    ] {
        let refused = output(RELIGHT, arguments);
        assert!(!refused.status.success(), "{arguments:?}: {refused:?}");
        let text = String::from_utf8(refused.stderr).unwrap();
        assert!(text.contains(printed) && !text.contains("is now"), "{text}");
    }
}

#[test]
fn only_maps_in_folders_that_exist_are_watched() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    for (file, more, printed) in [
        ("room.txt", &[][..], "a .map or .bsp file is watched"),
        ("none/room.map", &[], "no such folder"),
        (
            "room.map",
            &["--compiler", "/no/such/q3map2"],
            "no such program",
        ),
    ] {
        let file = path(file);
        let cache = path("cache");
        let refused = output(
            RELIGHT,
            &[&["watch", file.as_str(), "--cache", cache.as_str()], more].concat(),
        );
        assert!(!refused.status.success(), "{file}: {refused:?}");
        let text = String::from_utf8(refused.stderr).unwrap();
        assert!(text.contains(printed), "{text}");
    }
}

#[test]
fn samples_are_written_as_packs_and_never_over_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let pack = folder.path().join("surfaces.pk3");
    let path = pack.to_str().unwrap();
    let write = |name: &str, path: &str| output(RELIGHT, &["sample", name, "-o", path]);
    assert!(write("surfaces", path).status.success());
    let info = output(RELIGHT, &["info", path]);
    assert!(info.status.success(), "{info:?}");
    let bytes = std::fs::read(&pack).unwrap();
    assert!(bytes.len() < 1_000_000);
    for (name, path) in [
        ("surfaces", path),
        ("surfaces", "x.zip"),
        ("cellar", "y.pk3"),
    ] {
        let refused = write(name, path);
        assert!(!refused.status.success(), "{name} {path}");
        assert!(!refused.stderr.is_empty());
    }
    assert_eq!(std::fs::read(&pack).unwrap(), bytes);
}

#[test]
fn a_bake_writes_a_whole_map_or_leaves_the_file_that_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (pack, baked, broken) = (path("hall.pk3"), path("hall.bsp"), path("broken.bsp"));
    assert!(
        output(RELIGHT, &["sample", "hall", "-o", &pack])
            .status
            .success()
    );
    let bake = |map: &str, out: &str, more: &[&str]| {
        let usual = ["bake", map, "-o", out, "--game", &pack, "--device", "cpu"];
        output(RELIGHT, &[&usual[..], more].concat())
    };
    let rough = ["--fast", "--no-calibration", "--preview"];
    let done = bake(&pack, &baked, &rough);
    assert!(done.status.success(), "{done:?}");
    let text = String::from_utf8_lossy(&done.stdout);
    assert!(
        text.contains("0 of 1 bounces") && text.contains("direct light"),
        "{text}"
    );
    let bytes = std::fs::read(&baked).unwrap();
    let bsp = q3bsp::Bsp::parse(&bytes).unwrap();
    assert!(
        bsp.lightmaps
            .iter()
            .any(|page| page.0.iter().any(|byte| *byte > 0))
    );

    let fine = path("z_hall_relit.pk3");
    let done = bake(
        &pack,
        &fine,
        &["--fast", "--no-calibration", "--texels", "2", "--external"],
    );
    assert!(done.status.success(), "{done:?}");
    let shown = output(RELIGHT, &["info", &fine, "--game", &pack]);
    assert!(shown.status.success(), "{shown:?}");

    // several maps at once
    let (copy, both) = (path("copy.bsp"), path("both"));
    std::fs::copy(&baked, &copy).unwrap();
    let done = bake(&baked, &both, &[&copy, "--fast", "--no-calibration"]);
    assert!(done.status.success(), "{done:?}");
    let light = |name: &str| {
        let bytes = std::fs::read(folder.path().join("both").join(name)).unwrap();
        q3bsp::Bsp::parse(&bytes).unwrap().lightmaps
    };
    assert!(light("hall.bsp") == bsp.lightmaps && light("copy.bsp") == bsp.lightmaps);

    std::fs::write(&broken, b"IBSP").unwrap();
    let refused = bake(&broken, &baked, &rough);
    assert!(!refused.status.success());
    assert!(
        String::from_utf8_lossy(&refused.stderr).contains("broken.bsp"),
        "{refused:?}"
    );
    assert_eq!(std::fs::read(&baked).unwrap(), bytes);

    // one pack of several maps, whole or as it was; and a pack each
    let all = path("z_all.pk3");
    let quick = ["--fast", "--no-calibration"];
    let second = path("hall2.bsp");
    std::fs::write(&second, &bytes).unwrap();
    let done = bake(&pack, &all, &[&quick[..], &[&second]].concat());
    assert!(done.status.success(), "{done:?}");
    use relight::GameFiles;
    let relit = relight::Pk3::open(std::path::Path::new(&all)).unwrap();
    assert!(relit.exists("maps/sample.bsp") && relit.exists("maps/hall2.bsp"));
    let whole = std::fs::read(&all).unwrap();
    let refused = bake(&second, &all, &[&quick[..], &[&broken]].concat());
    assert!(!refused.status.success());
    assert_eq!(std::fs::read(&all).unwrap(), whole);
    let each = path("each");
    let packs = [&quick[..], &["--format", "pk3"]].concat();
    assert!(bake(&second, &each, &packs).status.success());
    assert!(folder.path().join("each/z_hall2_relit.pk3").is_file());

    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 9, "a temporary file is left");
}
