//! The stand-in's file system: files in memory above the packs of a folder, and a home folder for what is written.
//!
//! Deliberately not the renderer's own reader of packs, so that the two cannot be wrong together.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use zip::ZipArchive;

/// Packs and the names in them; opened once, shared by engines.
#[derive(Clone, Default)]
pub struct Packs {
    /// In falling priority: a pack that sorts later overrides.
    packs: Vec<Arc<Pack>>,
}

struct Pack {
    archive: Mutex<ZipArchive<File>>,
    /// Lower-case name to number, and the names in the order of the pack.
    index: HashMap<String, usize>,
    names: Vec<String>,
}

impl Packs {
    /// All packs of `folder`.
    pub fn open(folder: &Path) -> std::io::Result<Self> {
        let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?
            .flatten()
            .map(|e| e.path())
            .collect();
        paths.retain(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("pk3")));
        paths.sort();
        let mut packs = Vec::new();
        for path in paths.iter().rev() {
            let mut archive = ZipArchive::new(File::open(path)?).map_err(std::io::Error::other)?;
            let mut index = HashMap::new();
            let mut names = Vec::new();
            for i in 0..archive.len() {
                let entry = archive.by_index_raw(i).map_err(std::io::Error::other)?;
                let name = key(&String::from_utf8_lossy(entry.name_raw()));
                index.insert(name.clone(), i);
                names.push(name);
            }
            packs.push(Arc::new(Pack {
                archive: Mutex::new(archive),
                index,
                names,
            }));
        }
        Ok(Self { packs })
    }
}

/// The files of `FS_*`.
pub struct Files {
    memory: BTreeMap<String, Vec<u8>>,
    packs: Packs,
    home: PathBuf,
    pure: bool,
}

/// Names compare without case, and a backslash is a slash.
fn key(name: &str) -> String {
    name.replace('\\', "/").to_ascii_lowercase()
}

impl Files {
    /// `memory` lies above `packs`; `home` is the folder for what is written.
    pub fn new(memory: &[(String, Vec<u8>)], packs: Packs, home: PathBuf) -> Self {
        let memory = memory
            .iter()
            .map(|(name, bytes)| (key(name), bytes.clone()))
            .collect();
        Self {
            memory,
            packs,
            home,
            pure: false,
        }
    }

    /// From now on only packs (and the memory, which stands for one) are read, as on a pure server.
    pub fn read_packs_only(&mut self) {
        self.pure = true;
    }

    /// Adds or replaces a file in memory.
    pub fn insert(&mut self, name: &str, bytes: Vec<u8>) {
        self.memory.insert(key(name), bytes);
    }

    /// The file's bytes, if it exists.
    pub fn read(&self, name: &str) -> Option<Vec<u8>> {
        let name = key(name);
        if let Some(bytes) = self.memory.get(&name) {
            return Some(bytes.clone());
        }
        for pack in &self.packs.packs {
            if let Some(&i) = pack.index.get(&name) {
                let mut archive = pack.archive.lock().ok()?;
                let mut bytes = Vec::new();
                archive.by_index(i).ok()?.read_to_end(&mut bytes).ok()?;
                return Some(bytes);
            }
        }
        if self.pure {
            return None;
        }
        std::fs::read(self.home.join(&name)).ok()
    }

    /// Whether a pack (or the memory, which stands for one) has it.
    pub fn in_pack(&self, name: &str) -> bool {
        let name = key(name);
        self.memory.contains_key(&name)
            || self.packs.packs.iter().any(|p| p.index.contains_key(&name))
    }

    /// Whether the home folder has it: the only place where the engine's `FS_FileExists` looks.
    pub fn exists_at_home(&self, name: &str) -> bool {
        self.home.join(name).is_file()
    }

    /// Names directly in `dir` that end in `extension`, highest priority first, each once.
    pub fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        let dir = key(dir.trim_matches('/'));
        let prefix = if dir.is_empty() { dir } else { dir + "/" };
        let extension = key(extension);
        let mut seen = HashSet::new();
        let packed = self.packs.packs.iter().flat_map(|p| &p.names);
        self.memory
            .keys()
            .chain(packed)
            .filter_map(|name| name.strip_prefix(&prefix))
            .filter(|name| !name.is_empty() && !name.contains('/') && name.ends_with(&extension))
            .filter(|name| seen.insert(name.to_string()))
            .map(str::to_string)
            .collect()
    }

    /// Writes below the home folder.
    pub fn write(&self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        let path = self.home.join(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(path, bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_without_case_and_listed_once() {
        let home = tempfile::tempdir().unwrap();
        let memory = [
            ("Scripts/One.SHADER".to_string(), b"1".to_vec()),
            ("scripts/deep/two.shader".to_string(), b"2".to_vec()),
            ("scripts/three.txt".to_string(), b"3".to_vec()),
        ];
        let mut files = Files::new(&memory, Packs::default(), home.path().to_path_buf());
        assert_eq!(files.read("scripts\\one.shader").unwrap(), b"1");
        assert_eq!(files.list("scripts", ".shader"), ["one.shader"]);
        assert!(files.in_pack("scripts/three.txt") && !files.in_pack("scripts/four.txt"));
        files.insert("scripts/one.shader", b"new".to_vec());
        assert_eq!(files.read("SCRIPTS/ONE.shader").unwrap(), b"new");
        files.write("shots/a.tga", b"x").unwrap();
        assert!(files.exists_at_home("shots/a.tga") && !files.exists_at_home("scripts/one.shader"));
    }
}
