//! The driver's pipeline cache in a file, so that the next start and every `vid_restart` need not compile.

use std::io;
use std::path::{Path, PathBuf};

use crate::gpu::{self, Device};

/// The file of a device's pipeline cache. If it cannot be read or written, the log has one warning, and pipelines are
/// compiled.
#[derive(Debug, Default)]
pub(crate) struct KeptPipelines {
    /// `None`: the cache is not stored.
    path: Option<PathBuf>,
    /// Length and hash of the file's content.
    held: Option<(usize, u64)>,
    /// Writing failed.
    failed: bool,
}

impl KeptPipelines {
    /// Reads the file; the second value is the initial content of the device's cache.
    pub fn read(path: Option<PathBuf>) -> (Self, Option<Vec<u8>>) {
        let mut kept = Self {
            path,
            ..Self::default()
        };
        let Some(path) = &kept.path else {
            return (kept, None);
        };
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return (kept, None),
            Err(e) => {
                log::warn!("{}: cannot be read: {e}", path.display());
                return (kept, None);
            }
        };
        if !gpu::is_pipeline_cache(&bytes) {
            log::warn!(
                "{}: damaged or of another version; pipelines are compiled again",
                path.display()
            );
            return (kept, None);
        }
        kept.held = Some(mark(&bytes));
        (kept, Some(bytes))
    }

    /// Writes the file if the device has compiled pipelines since.
    pub fn write(&mut self, device: &Device) {
        let Some(path) = self.path.as_ref().filter(|_| !self.failed) else {
            return; // nothing is kept, or a warning was given
        };
        let result = device
            .pipeline_cache_data()
            .map_err(|e| e.to_string())
            .and_then(|bytes| {
                let mark = Some(mark(&bytes));
                if mark != self.held {
                    write_whole(path, &bytes).map_err(|e| e.to_string())?;
                    self.held = mark;
                }
                Ok(())
            });
        if let Err(e) = result {
            log::warn!("{}: cannot be written: {e}", path.display());
            self.failed = true;
        }
    }
}

fn mark(bytes: &[u8]) -> (usize, u64) {
    (bytes.len(), gpu::hash(bytes))
}

/// Writes a file atomically.
fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let unfinished = path.with_extension(format!("{}.part", std::process::id()));
    let written =
        std::fs::write(&unfinished, bytes).and_then(|()| std::fs::rename(&unfinished, path));
    if written.is_err() {
        // removes the rest of a failed attempt, if there is one
        let _ = std::fs::remove_file(&unfinished);
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{DeviceOptions, SurfaceSource};

    #[test]
    fn a_file_is_written_once_and_a_damaged_one_is_made_anew() {
        let made = Device::new(&DeviceOptions::default(), SurfaceSource::Headless);
        let Some(device) = testkit::device(made) else {
            return;
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/pipelines.cache");
        let (mut kept, nothing) = KeptPipelines::read(Some(path.clone()));
        assert!(nothing.is_none(), "there is no file yet");
        kept.write(&device);
        let good = std::fs::read(&path).unwrap();
        let (mut again, bytes) = KeptPipelines::read(Some(path.clone()));
        assert_eq!(bytes.as_deref(), Some(&good[..]));

        // unchanged content is not written
        std::fs::remove_file(&path).unwrap();
        again.write(&device);
        assert!(!path.exists());

        std::fs::write(&path, &good[..good.len() - 1]).unwrap();
        let (mut damaged, bytes) = KeptPipelines::read(Some(path.clone()));
        assert!(bytes.is_none());
        damaged.write(&device);
        assert_eq!(std::fs::read(&path).unwrap(), good);
    }

    #[test]
    fn without_a_path_no_cache_is_stored() {
        let (kept, bytes) = KeptPipelines::read(None);
        assert!(bytes.is_none() && kept.path.is_none());
        let folder = tempfile::tempdir().unwrap();
        let (kept, bytes) = KeptPipelines::read(Some(folder.path().to_owned()));
        assert!(
            bytes.is_none() && kept.held.is_none(),
            "a folder is no file"
        );
    }
}
