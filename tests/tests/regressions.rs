//! Every file of `regressions/` must be read or refused. Each breaks a reader that lacks a check.

#![forbid(unsafe_code)]

use relight::{Materials, MemoryFiles, Options, RelitWorld, image};
use std::fs;
use std::path::{Path, PathBuf};

#[path = "../../q3bsp/tests/common/exercise.rs"]
mod exercise;
#[path = "../../q3bsp/tests/common/survive.rs"]
mod map;
#[path = "../../q3model/tests/common/survive.rs"]
mod model;
#[path = "../../shaderscript/tests/common/survive.rs"]
mod script;

/// The paths in a folder, in order.
fn listed(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths
}

/// Reads a map, and relights one that is accepted.
fn relit(bytes: &[u8]) -> bool {
    if !map::survive(bytes) {
        return false;
    }
    let files = MemoryFiles::new();
    let (materials, _) = Materials::load(&files);
    let bsp = q3bsp::Bsp::parse(bytes).expect("it was accepted");
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::from_bsp(&files, &materials, "regression", bsp, options);
    let points = world.point_lights.iter().map(|light| light.intensity);
    let mut strengths = points.chain(world.lights.iter().map(|light| light.power()));
    assert!(strengths.all(|strength| strength.length_squared().is_finite()));
    true
}

#[test]
fn what_broke_a_reader_once_is_read_or_refused() {
    let root = tests::data::repository().join("regressions");
    let readme = fs::read_to_string(root.join("README.md")).expect("a description");
    let folders = listed(&root).into_iter().filter(|path| path.is_dir());
    let files: Vec<PathBuf> = folders.flat_map(|folder| listed(&folder)).collect();
    assert!(files.len() > 5, "{files:?}");
    for file in files {
        // A test that fails shows it.
        println!("{}", file.display());
        let name = file
            .strip_prefix(&root)
            .expect("it lies below")
            .display()
            .to_string();
        assert!(
            readme.contains(&format!("`{name}`")),
            "{name} is not described"
        );
        let bytes = fs::read(&file).expect("a file");
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        match &*extension {
            "bsp" => relit(&bytes),
            "shader" => script::survive(&bytes, 1.25),
            "md3" => model::survive_md3(&bytes),
            "mdr" => model::survive_mdr(&bytes),
            "iqm" => model::survive_iqm(&bytes),
            "skin" => model::survive_skin(&bytes),
            image if image::EXTENSIONS.contains(&image) => {
                image::decode(&name, image, &bytes).is_ok()
            }
            other => panic!("{name}: no reader of .{other}"),
        };
    }
}
