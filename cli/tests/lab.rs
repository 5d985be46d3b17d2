//! The measurements of `relight-lab` and the frame times of `relight render`, at the smallest size: a dim room with one
//! lamp.

use std::path::Path;
use std::process::{Command, Output};

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use serde_json::Value;

const LAB: &str = env!("CARGO_BIN_EXE_relight-lab");

/// Whether a device traces; without one the calling test is skipped.
fn has_device() -> bool {
    testkit::device(renderer_vk::probe(None)).is_some()
}

/// A folder with a room as a game.
fn room() -> tempfile::TempDir {
    let mut map = MapBuilder::new();
    let solid = q3bsp::content_flags::SOLID;
    let [wall, lamp] = ["t/wall", "t/lamp"].map(|name| map.add_shader(name, 0, solid));
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let corner = |x, y| Vec3::new(x, y, 120.0);
    map.add_quad(
        lamp,
        [
            corner(0.0, 0.0),
            corner(40.0, 0.0),
            corner(40.0, 40.0),
            corner(0.0, 40.0),
        ],
    );
    map.add_entity(&[
        ("classname", "info_player_deathmatch"),
        ("origin", "0 0 -60"),
    ]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("scripts")).unwrap();
    let script =
        "t/lamp\n{\nsurfaceparm nolightmap\nq3map_surfacelight 2000\n{\nmap $whiteimage\n}\n}\n";
    std::fs::write(folder.path().join("scripts/t.shader"), script).unwrap();
    std::fs::write(folder.path().join("room.bsp"), map.build().write()).unwrap();
    folder
}

/// Runs a program in a folder.
fn run(program: &str, folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(program);
    let output = command
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    output
}

/// JSON that `relight-lab measure` prints for the room, without its measurements of lights.
fn measured(folder: &Path, arguments: &[&str]) -> Value {
    const MEASURE: [&str; 13] = [
        "measure",
        "room.bsp",
        "--size",
        "32x24",
        "--reference",
        "4",
        "--frames",
        "2",
        "--views",
        "1",
        "--json",
        "--game",
        ".",
    ];
    let printed = run(LAB, folder, &[&MEASURE, arguments].concat()).stdout;
    let all: Value = serde_json::from_slice(&printed).unwrap();
    all["room-0"].clone()
}

#[test]
fn every_frame_is_timed() {
    if !has_device() {
        return;
    }
    let folder = room();
    let output = run(
        env!("CARGO_BIN_EXE_relight"),
        folder.path(),
        &[
            "render",
            "room.bsp",
            "-o",
            "r.png",
            "--look",
            "classic",
            "--size",
            "32x24",
            "--spp",
            "12",
            "--timings",
            "--frame-times",
            "f.csv",
            "--game",
            ".",
        ],
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["cold"]["frames"], 6);
    let csv = std::fs::read_to_string(folder.path().join("f.csv")).unwrap();
    assert_eq!(csv.lines().count(), 13);
    let times: Vec<f64> = (csv.lines().skip(1))
        .filter_map(|line| line.split(',').nth(2)?.parse().ok())
        .collect();
    // of no frame, or of each, the last ones included
    match report["gpu_ms"]["worst"].as_f64() {
        Some(worst) => {
            assert_eq!(times.len(), 12, "{csv}");
            let warm = times[6..].iter().copied().fold(0.0, f64::max);
            assert!((warm - worst).abs() < 1e-3, "{worst}: {csv}");
        }
        None => assert!(times.is_empty()),
    }
    let lines = String::from_utf8(output.stderr).unwrap();
    assert!(lines.contains("frames after the first 6"), "{lines}");
}

#[test]
fn costs_grow_along_an_axis() {
    if !has_device() {
        return;
    }
    let folder = room();
    // the sizes are the smallest that make a curve
    let arguments = "growth -o out --size 32x18 --frames 4 --axis lights=1,4,16 --axis mirrors=0,2";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    run(LAB, folder.path(), &arguments);
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let report: Value = serde_json::from_str(&read("growth.json")).unwrap();
    for (axis, name, sizes) in [(0, "lights", 3), (1, "mirrors", 2)] {
        let axis = &report["axes"][axis];
        assert_eq!(
            (&axis["axis"], &axis["ended"]),
            (&name.into(), &Value::Null)
        );
        let rows = axis["rows"].as_array().unwrap();
        assert_eq!(rows.len(), sizes);
        for row in rows {
            assert!(
                row["passes"]
                    .as_array()
                    .is_some_and(|passes| passes.len() > 5),
                "{row}"
            );
            assert!(
                row["megabytes"]
                    .as_array()
                    .is_some_and(|parts| parts.len() == 6)
            );
        }
    }
    assert_eq!(read("growth.html").matches("<svg").count(), 4);
    assert!(read("growth.csv").contains("lights,16,mb,lights,"));
    assert!(folder.path().join("out/mirrors.png").exists());
}

#[test]
fn tracers_are_compared() {
    if !has_device() {
        return;
    }
    let folder = room();
    // one set of passes: a software driver takes long to compile them
    let arguments = "tracers room.bsp --made 36 -o out.json --size 32x32 --frames 4 --runs 2 --tracer grid=20 --tracer grid";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let printed = run(LAB, folder.path(), &arguments);
    let text = std::fs::read_to_string(folder.path().join("out.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for (row, tracer) in rows.iter().zip(["grid 20", "grid"].iter().cycle()) {
        assert_eq!(row["tracer"], *tracer);
        assert_eq!(row["build_ms"].as_array().map(Vec::len), Some(2));
        assert!(row["bytes"].as_u64() > Some(500), "{row}");
        // nothing in the map gathers bounced light
        let passes = if row["scene"] == "room" { 1 } else { 3 };
        for rates in row["mrays"].as_array().unwrap().iter().take(passes) {
            let rates = rates.as_array().unwrap();
            assert_eq!(rates.len(), 2);
            assert!(rates.iter().all(|rate| rate.as_f64() > Some(0.0)), "{row}");
        }
    }
    assert_eq!(rows[2]["cells"][0], 20);
    assert_eq!(rows[2]["triangles"], 36);
    let table = String::from_utf8_lossy(&printed.stdout);
    assert_eq!(table.matches("| made 36 |").count(), 2, "{table}");
}

#[test]
fn structures_of_bodies_are_measured_with_and_without_feedback() {
    if !has_device() {
        return;
    }
    let folder = room();
    let arguments =
        "bodies room.bsp --animated 4 --still 9 -o out.json --size 32x32 --frames 6 --runs 1";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let printed = run(LAB, folder.path(), &arguments);
    let text = std::fs::read_to_string(folder.path().join("out.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!([&report["animated"], &report["still"]], [4, 9]);
    let [without, with] = report["rows"].as_array().unwrap().as_slice() else {
        panic!("{text}");
    };
    for (row, feedback) in [(without, false), (with, true)] {
        assert_eq!(row["feedback"], feedback);
        assert_eq!(row["moving"]["frames"], 3, "the second half");
        assert_eq!(row["moving"]["parts"], 4 * 3);
        assert_eq!(row["moving"]["refits"], 4 * 3, "nothing rests so early");
    }
    assert_eq!(without["moving"]["counted"], 0);
    assert_eq!(with["moving"]["counted"], 4 * 3);
    assert_eq!(with["moving"]["bodies"], 13 * 3);
    assert_eq!(report["differing"], serde_json::json!([]));
    let table = String::from_utf8_lossy(&printed.stdout);
    assert!(table.contains("| without | 1.0000 |"), "{table}");
}

#[test]
fn pictures_after_a_cut_and_of_a_walk_are_compared_with_the_reference() {
    if !has_device() {
        return;
    }
    let folder = room();
    let cut = measured(folder.path(), &["--cut", "--picture", "denoised-taa"]);
    let ssim = cut["denoised-taa"]["ssim"].as_array().unwrap();
    assert_eq!(ssim.len(), 6);
    let [first, last] = [0, 5].map(|at| ssim[at].as_f64().unwrap());
    assert!(last > 0.5 && last >= first - 0.1, "{first} to {last}");

    let clips = ["--clips", "out", "--clip-frames", "3", "--picture", "raw"];
    let clip = measured(folder.path(), &clips);
    assert_eq!((&clip["frames"], &clip["width"]), (&3.into(), &32.into()));
    let out = folder.path().join("out/room-0");
    let path = std::fs::read_to_string(out.join("path.txt")).unwrap();
    assert_eq!(path.lines().count(), 3);
    for picture in [
        "raw/0002.png",
        "reference/0000.png",
        "reference/0002.png",
        "clip.json",
    ] {
        assert!(out.join(picture).exists(), "{picture}");
    }
}

#[test]
fn light_samples_denoisers_and_antialiasing_are_a_matrix() {
    if !has_device() {
        return;
    }
    let cells = measured(room().path(), &["--matrix"]);
    let cells = cells.as_array().unwrap();
    assert_eq!(cells.len(), 36);
    let known =
        |cell: &&Value| cell["ssim"].is_f64() && cell["noise"].is_f64() && cell["gpu_ms"].is_f64();
    assert!(cells.iter().all(|cell| known(&cell)), "{cells:?}");
    assert_eq!(
        (&cells[0]["samples"], &cells[35]["samples"]),
        (&"1".into(), &"all".into())
    );
}

#[test]
fn devices_share_a_picture_without_changing_it() {
    if !has_device() {
        return;
    }
    let folder = room();
    let draw = |devices: &str, name: &str| {
        run(
            env!("CARGO_BIN_EXE_relight"),
            folder.path(),
            &[
                "render",
                "room.bsp",
                "--game",
                ".",
                "--size",
                "48x32",
                "--spp",
                "6",
                "-o",
                name,
                "--devices",
                devices,
            ],
        );
        image::open(folder.path().join(name)).unwrap().to_rgb8()
    };
    let alone = draw("0", "alone.png");
    // two and four frames in one, three parts
    for (devices, name) in [("0,0", "two.png"), ("0,0,0,0", "four.png")] {
        let shared = draw(devices, name);
        let most = alone
            .iter()
            .zip(shared.iter())
            .map(|(a, b)| a.abs_diff(*b))
            .max();
        assert!(most <= Some(1), "{devices}: {most:?}");
    }
}
