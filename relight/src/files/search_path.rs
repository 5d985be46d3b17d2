//! The engine's search path: game folders with their packs, in order of priority.

use super::{FileError, Folder, GameFiles, Pak, Pk3, normalise};
use std::cmp::Ordering;
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The search path of an id Tech 3 engine.
///
/// Rules (Source: behaviour of ioquake3's file system):
/// * Game folders are added in rising priority: what a later folder has hides what an earlier one has.
/// * Inside a game folder, `*.pk3` files and `*.pk3dir` folders are sorted by name (see
///   [`compare_pack_names`]); a later name has priority.
/// * `*.pak` files, those of Quake and Quake II, are below them, sorted in the same way.
/// * The folder's own loose files have priority over its packs.
#[derive(Debug, Default)]
pub struct SearchPath {
    /// In rising priority.
    sources: Vec<Source>,
    problems: Vec<FileError>,
}

#[derive(Debug)]
enum Source {
    Pk3(Box<Pk3>),
    Pak(Box<Pak>),
    Folder(Folder),
}

impl Source {
    fn files(&self) -> &dyn GameFiles {
        match self {
            Source::Pk3(pk3) => pk3.as_ref(),
            Source::Pak(pak) => pak.as_ref(),
            Source::Folder(folder) => folder,
        }
    }
}

impl SearchPath {
    /// A search path without sources.
    pub fn new() -> Self {
        Self::default()
    }

    /// Opens game folders, given in rising priority (`baseoa` first, the mod after it).
    ///
    /// A pack that cannot be opened is left out, as the engine leaves it out, and kept in
    /// [`problems`](Self::problems).
    ///
    /// # Errors
    /// [`FileError::Io`] when a game folder cannot be read.
    pub fn open<P: AsRef<Path>>(game_dirs: &[P]) -> Result<Self, FileError> {
        let mut path = Self::new();
        for dir in game_dirs {
            path.add_game_folder(dir.as_ref())?;
        }
        Ok(path)
    }

    /// Adds a game folder with its packs above everything added before.
    ///
    /// # Errors
    /// [`FileError::Io`] when the folder cannot be read.
    pub fn add_game_folder(&mut self, dir: &Path) -> Result<(), FileError> {
        let loose = Folder::open(dir)?;
        let entries = fs::read_dir(dir).map_err(|source| FileError::Io {
            path: dir.display().to_string(),
            source,
        })?;
        let mut packs: Vec<(String, PathBuf)> = entries
            .flatten()
            .map(|entry| {
                (
                    entry.file_name().to_string_lossy().into_owned(),
                    entry.path(),
                )
            })
            .filter(|(name, path)| {
                let lower = name.to_ascii_lowercase();
                if path.is_dir() {
                    lower.ends_with(".pk3dir")
                } else {
                    lower.ends_with(".pk3") || lower.ends_with(".pak")
                }
            })
            .collect();
        let is_pak = |name: &str| name.to_ascii_lowercase().ends_with(".pak");
        packs.sort_by(|a, b| {
            let kinds = is_pak(&b.0).cmp(&is_pak(&a.0));
            let names = compare_pack_names(&a.0, &b.0).then_with(|| a.0.cmp(&b.0));
            kinds.then(names)
        });
        for (name, path) in packs {
            let added = if path.is_dir() {
                self.add_folder(&path)
            } else if is_pak(&name) {
                Pak::open(&path).map(|pak| self.sources.push(Source::Pak(Box::new(pak))))
            } else {
                self.add_pk3(&path)
            };
            if let Err(problem) = added {
                log::warn!("{problem}");
                self.problems.push(problem);
            }
        }
        self.sources.push(Source::Folder(loose));
        Ok(())
    }

    /// Adds one pack above everything added before.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be opened or is not a zip archive.
    pub fn add_pk3(&mut self, path: &Path) -> Result<(), FileError> {
        self.sources.push(Source::Pk3(Box::new(Pk3::open(path)?)));
        Ok(())
    }

    /// Adds one folder of loose files, without its packs, above everything added before.
    ///
    /// # Errors
    /// [`FileError::Io`] when it cannot be read.
    pub fn add_folder(&mut self, path: &Path) -> Result<(), FileError> {
        self.sources.push(Source::Folder(Folder::open(path)?));
        Ok(())
    }

    /// Packs that were left out because they could not be opened.
    pub fn problems(&self) -> &[FileError] {
        &self.problems
    }
}

impl GameFiles for SearchPath {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        normalise(path)?;
        for source in self.sources.iter().rev() {
            if let Some(bytes) = source.files().read(path)? {
                return Ok(Some(bytes));
            }
        }
        Ok(None)
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        let mut seen = HashSet::new();
        let mut names = Vec::new();
        for source in self.sources.iter().rev() {
            for name in source.files().list(dir, extension) {
                if seen.insert(name.to_ascii_lowercase()) {
                    names.push(name);
                }
            }
        }
        names
    }

    fn exists(&self, path: &str) -> bool {
        self.sources
            .iter()
            .rev()
            .any(|source| source.files().exists(path))
    }
}

/// The engine's order of pack names: bytes, letters as upper case, `\` and `:` as `/`.
///
/// Upper case matters: `_` sorts after every letter, so `pak_x.pk3` beats `pakz.pk3`.
pub fn compare_pack_names(a: &str, b: &str) -> Ordering {
    let key = |name: &str| -> Vec<u8> {
        let fold = |byte: u8| match byte {
            b'\\' | b':' => b'/',
            other => other.to_ascii_uppercase(),
        };
        name.bytes().map(fold).collect()
    };
    key(a).cmp(&key(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn pk3(path: &Path, files: &[(&str, &str)]) {
        let mut zip = zip::ZipWriter::new(fs::File::create(path).unwrap());
        for (name, text) in files {
            zip.start_file(*name, zip::write::SimpleFileOptions::default())
                .unwrap();
            zip.write_all(text.as_bytes()).unwrap();
        }
        zip.finish().unwrap();
    }

    fn text(files: &dyn GameFiles, path: &str) -> String {
        String::from_utf8(files.read(path).unwrap().unwrap()).unwrap()
    }

    #[test]
    fn later_packs_and_loose_files_win() {
        let dir = tempfile::tempdir().unwrap();
        let base = dir.path().join("base");
        let game = dir.path().join("game");
        fs::create_dir_all(base.join("scripts")).unwrap();
        fs::create_dir_all(game.join("Scripts")).unwrap();
        pk3(
            &base.join("pak0.pk3"),
            &[
                ("a.txt", "pak0"),
                ("b.txt", "pak0"),
                ("scripts/one.shader", "pak0"),
            ],
        );
        pk3(
            &base.join("PAK1.pk3"),
            &[
                ("b.txt", "pak1"),
                ("scripts/two.shader", "x"),
                ("Scripts/ONE.shader", "pak1"),
            ],
        );
        pk3(&base.join("pak_.pk3"), &[("c.txt", "underscore")]);
        pk3(&base.join("pakz.pk3"), &[("c.txt", "z"), ("d.txt", "z")]);
        fs::write(base.join("d.txt"), "loose").unwrap();
        fs::write(base.join("scripts/three.shader"), "loose").unwrap();
        fs::write(game.join("Scripts/Two.shader"), "game").unwrap();
        fs::write(base.join("broken.pk3"), "no zip").unwrap();

        let path = SearchPath::open(&[&base, &game]).unwrap();
        assert_eq!(text(&path, "a.txt"), "pak0");
        assert_eq!(text(&path, "B.TXT"), "pak1");
        assert_eq!(text(&path, "c.txt"), "underscore");
        assert_eq!(text(&path, "d.txt"), "loose");
        assert_eq!(text(&path, "scripts\\one.shader"), "pak1");
        assert_eq!(text(&path, "scripts/two.shader"), "game");
        assert_eq!(path.problems().len(), 1);
        assert_eq!(
            path.list("scripts", ".shader"),
            ["Two.shader", "three.shader", "ONE.shader"]
        );
        assert!(path.read("scripts/none.shader").unwrap().is_none());
        assert!(matches!(
            path.read("../base/d.txt"),
            Err(FileError::Refused { .. })
        ));
        assert!(path.exists("SCRIPTS/three.shader") && !path.exists("scripts/none.shader"));
    }

    #[test]
    fn packs_list_one_level_below() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("x.pk3");
        pk3(
            &file,
            &[
                ("s/a.x", ""),
                ("s/b/c.x", ""),
                ("s/b/d/e.x", ""),
                ("../s/f.x", ""),
                ("sx/g.x", ""),
            ],
        );
        let pk3 = Pk3::open(&file).unwrap();
        assert_eq!(pk3.list("s", "x"), ["a.x", "b/c.x"]);
        assert!(pk3.read("s/f.x").unwrap().is_none());
    }

    #[test]
    fn a_bomb_is_read_by_what_comes_out() {
        // 8 MiB of zeros pack to a few KiB: a ratio far above the 894:1 of real packs, and fine.
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("x.pk3");
        let zeros = "\0".repeat(8 << 20);
        pk3(&file, &[("zeros", &zeros)]);
        assert!(fs::metadata(&file).unwrap().len() < 64 << 10);
        assert_eq!(
            Pk3::open(&file)
                .unwrap()
                .read("zeros")
                .unwrap()
                .unwrap()
                .len(),
            8 << 20
        );
    }
}
