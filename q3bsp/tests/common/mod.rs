//! Files of an installed OpenArena for tests.

use std::io::Read;
use std::path::PathBuf;

/// The game's folder, or `None` with a printed line when it is not installed. `OPENARENA_DATA` names
/// another one; with `RELIGHT_REQUIRE_DATA=1` absence fails the test.
pub fn data_folder() -> Option<PathBuf> {
    let default = || "/usr/share/games/openarena/baseoa".into();
    let folder: PathBuf = std::env::var_os("OPENARENA_DATA").map_or_else(default, PathBuf::from);
    if folder.join("pak0.pk3").exists() {
        return Some(folder);
    }
    let required = std::env::var_os("RELIGHT_REQUIRE_DATA").is_some_and(|v| v == "1");
    assert!(
        !required,
        "OpenArena's data is required but {} has none",
        folder.display()
    );
    println!("skipped: no OpenArena data in {}", folder.display());
    None
}

/// Calls `visit` with pak, name and bytes of every file whose name ends so, paks in search order, the
/// later overriding the earlier. Returns how many there were.
pub fn for_each_file(extension: &str, mut visit: impl FnMut(&str, &str, &[u8])) -> Option<usize> {
    let folder = data_folder()?;
    let mut paks: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "pk3"))
        .collect();
    paks.sort();
    let mut count = 0;
    for pak in paks {
        let pak_name = pak.file_stem().unwrap().to_string_lossy().into_owned();
        let mut archive = zip::ZipArchive::new(std::fs::File::open(&pak).unwrap()).unwrap();
        for at in 0..archive.len() {
            let mut file = archive.by_index(at).unwrap();
            let name = file.name().unwrap().into_owned();
            if name.to_ascii_lowercase().ends_with(extension) {
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes).unwrap();
                visit(&pak_name, &name, &bytes);
                count += 1;
            }
        }
    }
    Some(count)
}
