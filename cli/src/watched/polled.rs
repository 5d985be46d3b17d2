//! A file whose new versions are noticed once they are complete.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Looks without a change after which an incomplete file is an error.
const PATIENCE: u32 = 10;

/// A file older than this when it is first looked at is at rest.
const OLD: Duration = Duration::from_secs(1);

/// A version of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Version {
    modified: SystemTime,
    bytes: u64,
}

impl Version {
    fn of(path: &Path) -> Option<Self> {
        let file = std::fs::metadata(path)
            .ok()
            .filter(std::fs::Metadata::is_file)?;
        Some(Self {
            modified: file.modified().ok()?,
            bytes: file.len(),
        })
    }
}

/// Contents of a new version.
#[derive(Debug)]
pub struct New<T> {
    /// What was read.
    pub content: T,
    /// When it was written.
    pub saved: SystemTime,
}

/// A file that is looked at.
#[derive(Debug)]
pub struct Polled {
    path: PathBuf,
    /// The version that was read, or reported as damaged.
    done: Option<Version>,
    /// A newer one, and the number of looks at which it was the same.
    newer: Option<(Version, u32)>,
    looked: bool,
}

impl Polled {
    /// A file that need not exist.
    pub fn new(path: PathBuf) -> Self {
        Self {
            path,
            done: None,
            newer: None,
            looked: false,
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// When it was written, if it exists.
    pub fn modified(&self) -> Option<SystemTime> {
        Version::of(&self.path).map(|version| version.modified)
    }

    /// A new version, once it is at rest and `read` accepts it; the error of `read` if it does not for long. Each version
    /// is returned once.
    pub fn look<T>(
        &mut self,
        read: impl Fn(Vec<u8>) -> Result<T, String>,
    ) -> Option<Result<New<T>, String>> {
        let first = !std::mem::replace(&mut self.looked, true);
        let version = Version::of(&self.path)?;
        if self.done == Some(version) {
            self.newer = None;
            return None;
        }
        let looks = match self.newer {
            Some((newer, looks)) if newer == version => looks + 1,
            _ => 0,
        };
        self.newer = Some((version, looks));
        let old = |v: Version| v.modified.elapsed().is_ok_and(|age| age > OLD);
        if looks == 0 && !(first && old(version)) {
            return None;
        }
        let whole = match std::fs::read(&self.path) {
            Ok(bytes) if Version::of(&self.path) != Some(version) => {
                drop(bytes);
                return None; // it is being written
            }
            Ok(bytes) => read(bytes),
            Err(e) => Err(format!("cannot be read: {e}")),
        };
        match whole {
            Ok(content) => {
                self.done = Some(version);
                Some(Ok(New {
                    content,
                    saved: version.modified,
                }))
            }
            Err(why) if looks >= PATIENCE => {
                self.done = Some(version);
                Some(Err(format!("{}: {why}", self.path.display())))
            }
            Err(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Accepts what ends in a point.
    fn sentence(bytes: Vec<u8>) -> Result<String, String> {
        let text = String::from_utf8(bytes).map_err(|e| e.to_string())?;
        match text.ends_with('.') {
            true => Ok(text),
            false => Err(format!("no sentence: {text}")),
        }
    }

    fn looks(file: &mut Polled, count: u32) -> Vec<Result<String, String>> {
        (0..count)
            .filter_map(|_| file.look(sentence))
            .map(|new| new.map(|new| new.content))
            .collect()
    }

    #[test]
    fn each_version_is_returned_once_when_it_is_at_rest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let mut file = Polled::new(path.clone());
        assert!(looks(&mut file, 3).is_empty());
        std::fs::write(&path, "One.").unwrap();
        // it may still grow
        assert!(looks(&mut file, 1).is_empty());
        assert_eq!(looks(&mut file, 3), [Ok("One.".to_owned())]);
        // written in pieces: complete at last
        std::fs::write(&path, "Two, ").unwrap();
        assert!(looks(&mut file, 4).is_empty());
        std::fs::write(&path, "Two, three.").unwrap();
        assert_eq!(looks(&mut file, 3), [Ok("Two, three.".to_owned())]);
        // by a new name, and absent for a while
        let other = folder.path().join("b.txt");
        std::fs::write(&other, "Four").unwrap();
        std::fs::write(&other, "Fourth.").unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(looks(&mut file, 3).is_empty());
        std::fs::rename(&other, &path).unwrap();
        assert_eq!(looks(&mut file, 3), [Ok("Fourth.".to_owned())]);
    }

    #[test]
    fn a_damaged_version_is_an_error_once_and_the_next_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let mut file = Polled::new(path.clone());
        std::fs::write(&path, "half").unwrap();
        assert!(looks(&mut file, PATIENCE).is_empty());
        let found = looks(&mut file, 20);
        let [Err(why)] = found.as_slice() else {
            panic!("{found:?}")
        };
        assert!(why.contains("a.txt: no sentence: half"), "{why}");
        std::fs::write(&path, "Whole.").unwrap();
        assert_eq!(looks(&mut file, 3), [Ok("Whole.".to_owned())]);
    }

    #[test]
    fn an_old_file_is_read_at_the_first_look() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::fs::write(&path, "Old.").unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(60))
            .unwrap();
        assert_eq!(looks(&mut Polled::new(path), 1), [Ok("Old.".to_owned())]);
    }
}
