//! Game files in memory, for tests and for made-up games.

use super::{FileError, GameFiles, listed, normalise};
use std::collections::HashMap;

/// Files held in memory; listed in the order in which they were first inserted.
#[derive(Debug, Clone, Default)]
pub struct MemoryFiles {
    files: Vec<(String, Vec<u8>)>,
    index: HashMap<String, usize>,
}

impl MemoryFiles {
    /// A game without files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file, or replaces the one of the same game path.
    ///
    /// # Errors
    /// [`FileError::Refused`] when `path` is not a path inside the game folder.
    pub fn insert(&mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Result<(), FileError> {
        let canonical = normalise(path)?;
        let entry = (path.replace('\\', "/"), bytes.into());
        match self
            .index
            .get(&canonical)
            .and_then(|&i| self.files.get_mut(i))
        {
            Some(slot) => *slot = entry,
            None => {
                self.index.insert(canonical, self.files.len());
                self.files.push(entry);
            }
        }
        Ok(())
    }
}

impl GameFiles for MemoryFiles {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        let found = self
            .index
            .get(&normalise(path)?)
            .and_then(|&i| self.files.get(i));
        Ok(found.map(|(_, bytes)| bytes.clone()))
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        listed(self.files.iter().map(|(path, _)| path), dir, extension)
    }

    fn exists(&self, path: &str) -> bool {
        normalise(path).is_ok_and(|path| self.index.contains_key(&path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_ignore_case_and_slashes() {
        let mut files = MemoryFiles::new();
        files.insert("Scripts\\A.shader", "one").unwrap();
        files.insert("scripts/b.shader", "two").unwrap();
        files.insert("scripts/a.SHADER", "three").unwrap();
        assert_eq!(files.read("SCRIPTS/a.shader").unwrap().unwrap(), b"three");
        assert_eq!(files.list("scripts/", ".shader"), ["a.SHADER", "b.shader"]);
        assert!(files.read("scripts/c.shader").unwrap().is_none());
        assert!(files.insert("../x", "").is_err());
    }
}
