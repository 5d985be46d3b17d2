//! Loose files in a folder on disk.

use super::{FileError, GameFiles, MAX_FILE_BYTES, has_extension, normalise, normalise_dir};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// A folder of loose game files.
///
/// Names are found without regard to case on every file system: first as written, then by comparing
/// the folder's entries.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The folder at `root`.
    ///
    /// # Errors
    /// [`FileError::Io`] when it is not a folder that can be read.
    pub fn open(root: impl Into<PathBuf>) -> Result<Self, FileError> {
        let root = root.into();
        fs::read_dir(&root).map_err(|source| io_error(&root, source))?;
        Ok(Self { root })
    }

    /// The folder on disk.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The place on disk of a path whose components need not have the right case.
    fn resolve(&self, path: &str) -> Option<PathBuf> {
        let mut at = self.root.clone();
        for component in path.split('/').filter(|c| !c.is_empty()) {
            let exact = at.join(component);
            if exact.exists() {
                at = exact;
                continue;
            }
            let mut alike: Vec<_> = fs::read_dir(&at)
                .ok()?
                .flatten()
                .map(|entry| entry.file_name())
                .filter(|name| {
                    name.to_str()
                        .is_some_and(|n| n.eq_ignore_ascii_case(component))
                })
                .collect();
            alike.sort();
            at.push(alike.into_iter().next()?);
        }
        Some(at)
    }
}

fn io_error(path: &Path, source: std::io::Error) -> FileError {
    FileError::Io {
        path: path.display().to_string(),
        source,
    }
}

/// Reads a file of at most [`MAX_FILE_BYTES`].
pub(super) fn read_capped(path: &Path) -> Result<Vec<u8>, FileError> {
    let file = File::open(path).map_err(|e| io_error(path, e))?;
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| io_error(path, e))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(FileError::TooLarge {
            name: path.display().to_string(),
            limit: MAX_FILE_BYTES,
        });
    }
    Ok(bytes)
}

impl GameFiles for Folder {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        normalise(path)?;
        match self.resolve(&path.replace('\\', "/")) {
            Some(found) if found.is_file() => read_capped(&found).map(Some),
            _ => Ok(None),
        }
    }

    /// Files of the folder alone (the engine does not look below loose folders), sorted by name,
    /// because the operating system promises no order.
    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        let entries = normalise_dir(dir)
            .and_then(|_| self.resolve(&dir.replace('\\', "/")))
            .and_then(|path| fs::read_dir(path).ok());
        let Some(entries) = entries else {
            return Vec::new();
        };
        let mut names: Vec<String> = entries
            .flatten()
            .filter(|entry| entry.path().is_file())
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| has_extension(name, extension))
            .collect();
        names.sort();
        names
    }

    fn exists(&self, path: &str) -> bool {
        normalise(path).is_ok()
            && self
                .resolve(&path.replace('\\', "/"))
                .is_some_and(|found| found.is_file())
    }
}
