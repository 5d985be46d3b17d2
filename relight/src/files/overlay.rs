//! Files in memory over other files.

use super::{FileError, GameFiles, MemoryFiles, Precedence};

/// A few files over a game's: what is in front hides what is behind.
#[derive(Debug)]
pub struct Overlay<B> {
    /// Files that are found first.
    pub front: MemoryFiles,
    /// All others.
    pub back: B,
}

impl<B: GameFiles> GameFiles for Overlay<B> {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        match self.front.read(path)? {
            Some(bytes) => Ok(Some(bytes)),
            None => self.back.read(path),
        }
    }

    /// What is in front comes last: of the definitions in scripts, those of the script listed last count.
    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        let front = self.front.list(dir, extension);
        let hidden = |name: &String| front.iter().any(|n| n.eq_ignore_ascii_case(name));
        let mut names = self.back.list(dir, extension);
        names.retain(|name| !hidden(name));
        names.extend(front);
        names
    }

    fn variable(&self, name: &str) -> String {
        self.back.variable(name)
    }

    fn precedence(&self) -> Precedence {
        self.back.precedence()
    }

    fn exists(&self, path: &str) -> bool {
        self.front.exists(path) || self.back.exists(path)
    }
}
