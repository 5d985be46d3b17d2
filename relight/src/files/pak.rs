//! PAK, the archives of Quake, GoldSrc and Quake II: files one after the other, nothing compressed, a directory of
//! entries of 64 bytes.

use super::{FileError, GameFiles, MAX_FILE_BYTES, listed, normalise};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use support::slice::item;

/// Bytes of an entry: a name of 56 bytes, offset, length.
const ENTRY: u64 = 64;

/// Most bytes of a directory: a million entries.
const MAX_DIRECTORY: u64 = ENTRY << 20;

/// An opened `.pak`.
#[derive(Debug)]
pub struct Pak {
    name: String,
    /// Names as stored, offsets and lengths.
    entries: Vec<(String, u64, u64)>,
    index: HashMap<String, usize>,
    file: Mutex<File>,
}

impl Pak {
    /// Opens an archive and reads its directory.
    ///
    /// # Errors
    /// [`FileError::Io`] when it cannot be read, [`FileError::Pack`] when it is no archive of this kind.
    pub fn open(path: &Path) -> Result<Pak, FileError> {
        let name = path.display().to_string();
        let io = |source| FileError::Io {
            path: path.display().to_string(),
            source,
        };
        let bad = |reason: &str| FileError::Pack {
            pack: path.display().to_string(),
            reason: reason.to_owned(),
        };
        let mut file = File::open(path).map_err(io)?;
        let mut header = [0; 12];
        file.read_exact(&mut header)
            .map_err(|_| bad("the header is cut short"))?;
        let words = header.as_chunks::<4>().0;
        let [ident, offset, length] = [0, 1, 2].map(|at| item(words, at));
        let (offset, length) = (u32::from_le_bytes(offset), u32::from_le_bytes(length));
        if &ident != b"PACK" {
            return Err(bad("it does not begin with PACK"));
        }
        let (offset, length) = (u64::from(offset), u64::from(length));
        let size = file.metadata().map_err(io)?.len();
        if offset + length > size || length > MAX_DIRECTORY || length % ENTRY != 0 {
            return Err(bad("the directory is not in the file"));
        }
        file.seek(SeekFrom::Start(offset)).map_err(io)?;
        let mut directory = Vec::new();
        Read::by_ref(&mut file)
            .take(length)
            .read_to_end(&mut directory)
            .map_err(io)?;
        let mut entries = Vec::new();
        let mut index = HashMap::new();
        for entry in directory.as_chunks::<64>().0 {
            let (raw, place) = entry.split_at(56);
            let end = raw.iter().position(|&b| b == 0).unwrap_or(raw.len());
            let stored = String::from_utf8_lossy(raw.get(..end).unwrap_or(raw)).replace('\\', "/");
            let words = place.as_chunks::<4>().0;
            let word = |at: usize| u64::from(u32::from_le_bytes(item(words, at)));
            let (start, length) = (word(0), word(1));
            if start + length > size {
                return Err(FileError::Entry {
                    pack: name,
                    name: stored,
                    reason: format!("{length} bytes at {start} are not in the file"),
                });
            }
            if let Ok(canonical) = normalise(&stored) {
                index.insert(canonical, entries.len());
                entries.push((stored, start, length));
            }
        }
        Ok(Pak {
            name,
            entries,
            index,
            file: Mutex::new(file),
        })
    }
}

impl GameFiles for Pak {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        let entry = self.index.get(&normalise(path)?);
        let Some((stored, start, length)) = entry.and_then(|&at| self.entries.get(at)) else {
            // The pack has no such file.
            return Ok(None);
        };
        if *length > MAX_FILE_BYTES {
            return Err(FileError::TooLarge {
                name: format!("{}: {stored}", self.name),
                limit: MAX_FILE_BYTES,
            });
        }
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let mut bytes = Vec::new();
        let read = file.seek(SeekFrom::Start(*start)).and_then(|_| {
            let got = Read::by_ref(&mut *file)
                .take(*length)
                .read_to_end(&mut bytes)?;
            match got as u64 == *length {
                true => Ok(()),
                false => Err(io::Error::from(io::ErrorKind::UnexpectedEof)),
            }
        });
        read.map_err(|problem| FileError::Entry {
            pack: self.name.clone(),
            name: stored.clone(),
            reason: problem.to_string(),
        })?;
        Ok(Some(bytes))
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        listed(self.entries.iter().map(|(path, ..)| path), dir, extension)
    }

    fn exists(&self, path: &str) -> bool {
        normalise(path).is_ok_and(|path| self.index.contains_key(&path))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
        let mut out = b"PACK".to_vec();
        let size: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
        out.extend((12 + size as u32).to_le_bytes());
        out.extend((64 * files.len() as u32).to_le_bytes());
        let mut directory = Vec::new();
        for (name, bytes) in files {
            let mut raw = [0; 56];
            raw[..name.len()].copy_from_slice(name.as_bytes());
            directory.extend(raw);
            directory.extend((out.len() as u32).to_le_bytes());
            directory.extend((bytes.len() as u32).to_le_bytes());
            out.extend_from_slice(bytes);
        }
        out.extend(directory);
        out
    }

    #[test]
    fn files_are_found_and_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pak0.pak");
        let whole = archive(&[
            ("maps/E1M1.bsp", b"map"),
            ("gfx/palette.lmp", b"colours"),
            ("empty", b""),
        ]);
        std::fs::write(&path, &whole).unwrap();
        let pak = Pak::open(&path).unwrap();
        assert_eq!(pak.read("MAPS\\e1m1.bsp").unwrap().unwrap(), b"map");
        assert_eq!(pak.read("empty").unwrap().unwrap(), b"");
        assert_eq!(pak.read("nothing").unwrap(), None);
        assert_eq!(pak.list("maps", ".bsp"), ["E1M1.bsp"]);
        assert!(pak.exists("gfx/PALETTE.lmp") && !pak.exists("gfx"));
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(Pak::open(&path).is_err(), "{length} bytes were enough");
        }
        let mut broken = whole;
        let at = broken.len() - 8;
        broken[at] = 255;
        std::fs::write(&path, &broken).unwrap();
        assert!(Pak::open(&path).unwrap_err().to_string().contains("empty"));
    }
}
