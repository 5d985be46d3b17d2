//! Where the things are that tests need, and what happens when they are not there: a test that lacks something is
//! skipped, and fails instead when `RELIGHT_REQUIRE_DATA=1` (data, tools) or `RELIGHT_REQUIRE_GPU=1` (a Vulkan device)
//! requires it.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use testkit::Need;

/// The repository's top folder.
pub fn repository() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_path_buf()
}

/// The renderer library: `RELIGHT_LIBRARY`, or the one that cargo builds beside the running test, brought up to
/// date first.
///
/// # Panics
/// When it does not build: every test that needs it has failed then.
pub fn library() -> PathBuf {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(find_library).clone()
}

fn find_library() -> PathBuf {
    match std::env::var_os("RELIGHT_LIBRARY") {
        Some(path) => PathBuf::from(path),
        None => built("ffi", "relight_ffi"),
    }
}

/// The dynamic library of a crate of the workspace, brought up to date.
///
/// # Panics
/// When it does not build.
pub fn built(package: &str, library: &str) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build
        .args(["build", "--quiet", "-p", package])
        .current_dir(repository());
    // <target>/<profile>/deps/<test> or <target>/<profile>/<program>
    let program = std::env::current_exe().expect("the path of this program");
    let folder = program.parent().expect("a program lies in a folder");
    let profile = match folder.parent() {
        Some(profile) if folder.ends_with("deps") => profile,
        _ => folder,
    };
    if profile.ends_with("release") {
        build.arg("--release");
    }
    let status = build.status().expect("cargo runs");
    assert!(status.success(), "cargo build -p {package} failed");
    let file = format!("{DLL_PREFIX}{library}{DLL_SUFFIX}");
    let library = profile.join(file);
    assert!(library.is_file(), "cargo built no {}", library.display());
    library
}

/// The engine's own renderer of that name (`opengl1`), in `ENGINE_DIR` or where Debian puts it, if it is there.
pub fn engine_renderer(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ENGINE_DIR")
        .map_or_else(|| PathBuf::from("/usr/lib/ioquake3"), PathBuf::from);
    let architecture = match std::env::consts::ARCH {
        "aarch64" => "arm64",
        other => other,
    };
    let file = folder.join(format!("renderer_{name}_{architecture}.so"));
    if file.is_file() {
        return Some(file);
    }
    testkit::absent(Need::Data, format!("{} is absent", file.display()));
    None
}

/// A program on the PATH.
pub fn tool(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let found = std::env::split_paths(&path)
        .map(|dir| dir.join(name))
        .find(|file| file.is_file());
    if found.is_none() {
        testkit::absent(Need::Data, format!("{name} is not installed"));
    }
    found
}

/// Keeps a picture as PNG in the folder `RELIGHT_PICTURES`, if that is set: for whoever wants to see what a test saw.
pub fn keep_picture(picture: &relight::compare::Rgb8, name: &str) {
    let Some(folder) = std::env::var_os("RELIGHT_PICTURES").map(PathBuf::from) else {
        return;
    };
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    let Some(image) = image::RgbImage::from_raw(width, height, picture.pixels().to_vec()) else {
        return;
    };
    let file = folder.join(format!("{name}.png"));
    let saved = std::fs::create_dir_all(&folder)
        .map_err(image::ImageError::IoError)
        .and_then(|()| image.save(&file));
    if let Err(error) = saved {
        println!("{}: {error}", file.display());
    }
}

/// Keeps a log in the folder `RELIGHT_PICTURES`, if that is set.
pub fn keep_text(text: &str, name: &str) {
    if let Some(folder) = std::env::var_os("RELIGHT_PICTURES").map(PathBuf::from) {
        let file = folder.join(format!("{name}.log"));
        if let Err(error) =
            std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, text))
        {
            println!("{}: {error}", file.display());
        }
    }
}
