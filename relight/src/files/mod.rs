//! Game files behind one trait: an id Tech 3 search path on disk, an engine's file system, or a test's memory.
//!
//! A *game path* is what scripts and maps write: relative, `/` or `\` between folders, case of no
//! importance. [`normalise`] gives its one canonical spelling, and refuses what would leave the game
//! folder.

mod folder;
mod memory;
mod overlay;
mod pak;
mod pk3;
mod search_path;

pub use folder::Folder;
pub use memory::MemoryFiles;
pub use overlay::Overlay;
pub use pak::Pak;
pub use pk3::Pk3;
pub use search_path::{SearchPath, compare_pack_names};
pub use shaderscript::Precedence;

use std::io;

/// The most bytes that one game file may have after decompression: 512 MiB.
///
/// The cap is on what comes out, never on a compression ratio: real game packs hold entries that
/// compress 894 to 1.
pub const MAX_FILE_BYTES: u64 = 512 << 20;

/// Why a game file that exists could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system refused a file or a folder.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder on disk.
        path: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A `.pk3` is not a zip archive that can be read.
    #[error("{pack}: not a readable pk3: {reason}")]
    Pack {
        /// The archive on disk.
        pack: String,
        /// Error of the zip reader.
        reason: String,
    },
    /// One entry of a `.pk3` cannot be read: damaged, encrypted, or of an unknown method.
    #[error("{pack}: {name}: {reason}")]
    Entry {
        /// The archive on disk.
        pack: String,
        /// The entry's name as stored.
        name: String,
        /// Error of the zip reader.
        reason: String,
    },
    /// A file is larger than [`MAX_FILE_BYTES`].
    #[error("{name}: more than {limit} bytes")]
    TooLarge {
        /// The file's game path, or its path on disk.
        name: String,
        /// The limit in bytes.
        limit: u64,
    },
    /// A game path that would leave the game folder, or cannot name a file at all.
    #[error("{path:?}: not a path inside the game folder")]
    Refused {
        /// The requested path.
        path: String,
    },
}

/// Where game files come from.
///
/// Paths are compared without regard to ASCII case, and `\` is the same as `/`, as inside an
/// engine's packs.
pub trait GameFiles {
    /// The whole content of a file; `None` when no source has it.
    ///
    /// # Errors
    /// [`FileError`] when the file exists but cannot be read, is too large, or `path` is not a path
    /// inside the game folder.
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError>;

    /// Names of the files in `dir` whose names end in `extension` (with or without its dot, case of
    /// no importance), relative to `dir`.
    ///
    /// The order is the engine's: the source with the highest priority first, inside a pack the
    /// order of its directory, a name that was already listed not again. Packs also list files one
    /// folder below `dir`, as the engine does.
    fn list(&self, dir: &str, extension: &str) -> Vec<String>;

    /// Value of a console variable of the engine that reads these files, which scripts may compare; empty if there is
    /// no engine or no such variable.
    fn variable(&self, _name: &str) -> String {
        String::new()
    }

    /// The definition that counts among several of one name in the scripts of these files.
    fn precedence(&self) -> Precedence {
        Precedence::default()
    }

    /// Whether [`read`](Self::read) would find the file.
    fn exists(&self, path: &str) -> bool {
        matches!(self.read(path), Ok(Some(_)))
    }
}

/// Game files behind a pointer.
macro_rules! behind {
    ($pointer:ty) => {
        impl<T: GameFiles + ?Sized> GameFiles for $pointer {
            fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
                (**self).read(path)
            }

            fn list(&self, dir: &str, extension: &str) -> Vec<String> {
                (**self).list(dir, extension)
            }

            fn variable(&self, name: &str) -> String {
                (**self).variable(name)
            }

            fn precedence(&self) -> Precedence {
                (**self).precedence()
            }

            fn exists(&self, path: &str) -> bool {
                (**self).exists(path)
            }
        }
    };
}

behind!(&T);
behind!(std::sync::Arc<T>);

/// The canonical spelling of a game path: lower case (ASCII), `/` between components, no empty
/// component and no `.`.
///
/// # Errors
/// [`FileError::Refused`] for an empty path, one with a `..` component, a `:` (drive letters, streams)
/// or a NUL byte.
pub fn normalise(path: &str) -> Result<String, FileError> {
    let refused = || FileError::Refused {
        path: path.to_owned(),
    };
    if path.contains([':', '\0']) {
        return Err(refused());
    }
    let mut out = String::with_capacity(path.len());
    for component in path.split(['/', '\\']) {
        match component {
            "" | "." => continue,
            ".." => return Err(refused()),
            _ => {}
        }
        if !out.is_empty() {
            out.push('/');
        }
        out.push_str(component);
    }
    if out.is_empty() {
        return Err(refused());
    }
    out.make_ascii_lowercase();
    Ok(out)
}

/// A folder's canonical spelling; the empty string is the game folder itself.
fn normalise_dir(dir: &str) -> Option<String> {
    if dir.chars().all(|c| matches!(c, '/' | '\\' | '.')) && !dir.contains("..") {
        return Some(String::new());
    }
    normalise(dir).ok()
}

/// Whether a file name ends in the extension, given with or without its dot.
fn has_extension(name: &str, extension: &str) -> bool {
    let extension = extension.strip_prefix('.').unwrap_or(extension).as_bytes();
    let name = name.as_bytes();
    if extension.is_empty() {
        return true;
    }
    let Some(stem) = name.len().checked_sub(extension.len() + 1) else {
        return false;
    };
    name.get(stem) == Some(&b'.')
        && name
            .get(stem + 1..)
            .is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// How far below a listed folder packs are searched: the folder and one more level.
const PACK_LIST_DEPTH: usize = 1;

/// The part of `path` below the canonical `dir`, when it lies there and no deeper than packs are listed.
fn below<'a>(path: &'a str, canonical: &str, dir: &str) -> Option<&'a str> {
    let rest = if dir.is_empty() {
        path
    } else {
        if !canonical.starts_with(dir) || canonical.as_bytes().get(dir.len()) != Some(&b'/') {
            return None;
        }
        path.get(dir.len() + 1..)?
    };
    (rest.matches('/').count() <= PACK_LIST_DEPTH).then_some(rest)
}

/// [`GameFiles::list`] of a pack with these paths.
fn listed<'a>(paths: impl Iterator<Item = &'a String>, dir: &str, extension: &str) -> Vec<String> {
    let Some(dir) = normalise_dir(dir) else {
        return Vec::new();
    };
    let names = paths.filter_map(|path| {
        let name = below(path, &path.to_ascii_lowercase(), &dir)?;
        has_extension(name, extension).then(|| name.to_owned())
    });
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalise_gives_one_spelling() {
        assert_eq!(normalise("Maps\\OA_DM1.bsp").unwrap(), "maps/oa_dm1.bsp");
        assert_eq!(normalise("/maps//./x.BSP").unwrap(), "maps/x.bsp");
    }

    #[test]
    fn normalise_refuses_what_leaves_the_folder() {
        for path in [
            "", "/", "..", "../x", "a/../b", "a\\..\\b", "c:/x", "a\0b", ".",
        ] {
            assert!(
                matches!(normalise(path), Err(FileError::Refused { .. })),
                "{path:?}"
            );
        }
        assert!(normalise("a/..b/c").is_ok());
    }

    #[test]
    fn extension_is_a_suffix_after_a_dot() {
        assert!(has_extension("a.SHADER", ".shader"));
        assert!(has_extension("a.shader", "shader"));
        assert!(!has_extension("ashader", "shader"));
        assert!(!has_extension("shader", ".shader"));
        assert!(has_extension("anything", ""));
    }
}
