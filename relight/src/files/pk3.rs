//! One `.pk3`: a zip archive of game files.

use super::{FileError, GameFiles, MAX_FILE_BYTES, listed, normalise};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use zip::ZipArchive;

/// An open `.pk3`.
///
/// Names are decoded from the archive's directory once. Of names that differ only in case the last
/// in the directory is found, as the engine's hash chains have it. Entries whose names would leave
/// the game folder can be neither listed nor read. Nothing is ever extracted to disk.
pub struct Pk3 {
    name: String,
    /// Entry names as stored (with `/`), and the entry's place in the archive.
    entries: Vec<(String, usize)>,
    /// Canonical path to a place in `entries`.
    index: HashMap<String, usize>,
    archive: Mutex<ZipArchive<BufReader<File>>>,
}

impl std::fmt::Debug for Pk3 {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pk3")
            .field("name", &self.name)
            .field("entries", &self.entries.len())
            .finish()
    }
}

impl Pk3 {
    /// Opens an archive and reads its directory.
    ///
    /// # Errors
    /// [`FileError::Io`] when the file cannot be opened, [`FileError::Pack`] when it is not a zip archive.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|source| FileError::Io {
            path: name.clone(),
            source,
        })?;
        let archive = ZipArchive::new(BufReader::new(file)).map_err(|e| FileError::Pack {
            pack: name.clone(),
            reason: e.to_string(),
        })?;
        let mut entries = Vec::new();
        let mut index = HashMap::new();
        for (place, raw) in archive.file_names_raw().enumerate() {
            let stored = String::from_utf8_lossy(raw).replace('\\', "/");
            if stored.ends_with('/') {
                continue;
            }
            if let Ok(canonical) = normalise(&stored) {
                index.insert(canonical, entries.len());
                entries.push((stored, place));
            }
        }
        Ok(Self {
            name,
            entries,
            index,
            archive: Mutex::new(archive),
        })
    }

    /// The archive's path on disk.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Game paths of all files, as stored, in the order of the archive's directory.
    pub fn all_names(&self) -> impl Iterator<Item = String> + '_ {
        self.entries.iter().map(|(name, _)| name.clone())
    }

    fn entry_error(&self, name: &str, reason: impl ToString) -> FileError {
        FileError::Entry {
            pack: self.name.clone(),
            name: name.to_owned(),
            reason: reason.to_string(),
        }
    }
}

impl GameFiles for Pk3 {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        let found = self
            .index
            .get(&normalise(path)?)
            .and_then(|&i| self.entries.get(i));
        let Some((stored, place)) = found else {
            return Ok(None);
        };
        // A panic while the lock was held cannot leave the archive half-changed in a way that
        // matters: every read seeks first.
        let mut archive = self.archive.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = archive
            .by_index(*place)
            .map_err(|e| self.entry_error(stored, e))?;
        // The declared size is a hint of the archive's writer: it sizes the buffer, within reason,
        // and the cap below is on what really comes out.
        let hint = entry.size().min(16 << 20);
        let mut bytes = Vec::with_capacity(usize::try_from(hint).unwrap_or(0));
        entry
            .take(MAX_FILE_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| self.entry_error(stored, e))?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            return Err(FileError::TooLarge {
                name: format!("{}: {stored}", self.name),
                limit: MAX_FILE_BYTES,
            });
        }
        Ok(Some(bytes))
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        listed(self.entries.iter().map(|(path, _)| path), dir, extension)
    }

    fn exists(&self, path: &str) -> bool {
        normalise(path).is_ok_and(|path| self.index.contains_key(&path))
    }
}
