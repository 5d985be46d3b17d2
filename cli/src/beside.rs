//! Files beside a map's own file, if the map is in no game folder.

use std::path::Path;

use anyhow::{Context, Result};
use relight::MemoryFiles;

/// Files beside `file` that belong to the map, under their paths in a game folder: lights and materials in files
/// (`NAME.lights`, `NAME.materials`) and lightmaps (`NAME/lm_0000.tga` and so on).
///
/// # Errors
/// Such a file exists and cannot be read.
pub fn beside(file: &Path) -> Result<MemoryFiles> {
    let mut found = MemoryFiles::new();
    add_beside(&mut found, file)?;
    Ok(found)
}

/// Adds them to `found`.
///
/// # Errors
/// As [`beside`].
pub fn add_beside(found: &mut MemoryFiles, file: &Path) -> Result<()> {
    // a path that ends in `..` has no name, so no files belong to it
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let mut take = |path: &Path, game_path: String| -> Result<()> {
        let bytes =
            std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
        Ok(found.insert(&game_path, bytes)?)
    };
    for extension in ["lights", "materials"] {
        let by_hand = file.with_extension(extension);
        if by_hand.is_file() {
            take(&by_hand, format!("maps/{stem}.{extension}"))?;
        }
    }
    let folder = file.with_extension("");
    if folder.is_dir() {
        let listed = std::fs::read_dir(&folder)
            .with_context(|| format!("{}: cannot be read", folder.display()))?;
        for entry in listed.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = entry.path();
            if name.to_ascii_lowercase().starts_with("lm_") && path.is_file() {
                take(&path, format!("maps/{stem}/{name}"))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::GameFiles;

    #[test]
    fn lights_and_lightmaps_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let map = folder.path().join("room.bsp");
        assert!(beside(&map).unwrap().list("maps", ".lights").is_empty());
        std::fs::write(folder.path().join("room.lights"), "x").unwrap();
        std::fs::write(folder.path().join("room.materials"), "x").unwrap();
        std::fs::create_dir(folder.path().join("room")).unwrap();
        std::fs::write(folder.path().join("room/lm_0000.tga"), "y").unwrap();
        std::fs::write(folder.path().join("room/notes.txt"), "z").unwrap();
        let found = beside(&map).unwrap();
        assert!(found.exists("maps/room.lights"));
        assert!(found.exists("maps/room.materials"));
        assert!(found.exists("maps/room/lm_0000.tga"));
        assert!(!found.exists("maps/room/notes.txt"));
    }
}
