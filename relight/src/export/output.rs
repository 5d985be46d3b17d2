//! Files that appear whole or not at all.

use super::ExportError;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Makes temporary names of one process differ.
static NUMBER: AtomicU64 = AtomicU64::new(0);

/// The files of one export: written under temporary names, renamed by `finish`, removed when dropped before.
#[derive(Debug)]
pub struct Output {
    main: PathBuf,
    /// Temporary name, final name, size in bytes.
    staged: Vec<(PathBuf, PathBuf, u64)>,
    /// Files that were there already, with the same content.
    kept: Vec<(PathBuf, u64)>,
}

impl Output {
    /// The output of the file `main`.
    pub fn new(main: &Path) -> Output {
        Output {
            main: main.to_owned(),
            staged: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// The requested file.
    pub fn main(&self) -> &Path {
        &self.main
    }

    /// Its name without folder and extension.
    pub fn stem(&self) -> String {
        self.main
            .file_stem()
            .map_or_else(|| "map".to_owned(), |s| s.to_string_lossy().into_owned())
    }

    /// Writes the requested file.
    ///
    /// # Errors
    /// [`ExportError::Write`].
    pub fn write_main(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        self.write(self.main.clone(), bytes)
    }

    /// Writes a file in the same folder as the main one; `name` may have folders, with `/`. What is there already with
    /// the same content stays.
    ///
    /// # Errors
    /// [`ExportError::Write`].
    pub fn write_beside(&mut self, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
        let path = self.main.with_file_name(name);
        let size = bytes.len() as u64;
        if self.staged.iter().any(|(_, to, _)| *to == path) {
            return Ok(());
        }
        let same_size = fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() == size);
        if same_size && fs::read(&path).is_ok_and(|there| there == bytes) {
            self.kept.push((path, size));
            return Ok(());
        }
        self.write(path, bytes)
    }

    fn write(&mut self, path: PathBuf, bytes: &[u8]) -> Result<(), ExportError> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            fs::create_dir_all(folder).map_err(|source| ExportError::Write {
                path: folder.to_owned(),
                source,
            })?;
        }
        // A path that ends in `..` has no name; writing to it fails below.
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let temporary =
            path.with_file_name(format!(".{name}.{}.{number}.part", std::process::id()));
        let written = fs::write(&temporary, bytes);
        self.staged.push((temporary, path, bytes.len() as u64));
        written.map_err(|source| ExportError::Write {
            path: self.main.clone(),
            source,
        })
    }

    /// Gives all files their names, the main one last, and lists them.
    ///
    /// # Errors
    /// [`ExportError::Write`]; files that had their names already keep them.
    pub fn finish(mut self) -> Result<Vec<(PathBuf, u64)>, ExportError> {
        let main = self.main.clone();
        self.staged.sort_by_key(|(_, to, _)| *to == main);
        let mut files = std::mem::take(&mut self.kept);
        while let Some((temporary, to, size)) = self.staged.first().cloned() {
            fs::rename(&temporary, &to).map_err(|source| ExportError::Write {
                path: to.clone(),
                source,
            })?;
            self.staged.remove(0);
            files.push((to, size));
        }
        Ok(files)
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        for (temporary, ..) in &self.staged {
            // Nothing can be done about a file that stays.
            let _ = fs::remove_file(temporary);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn nothing_is_left_of_an_output_that_was_given_up() {
        let folder = tempfile::tempdir().unwrap();
        let mut output = Output::new(&folder.path().join("map.glb"));
        output.write_main(b"half").unwrap();
        output.write_beside("map.bin", b"x").unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        drop(output);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn files_get_their_names_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let main = folder.path().join("map.gltf");
        fs::write(&main, "old").unwrap();
        let mut output = Output::new(&main);
        output.write_main(b"new").unwrap();
        output.write_beside("images/a.png", b"png").unwrap();
        output.write_beside("images/a.png", b"png").unwrap();
        assert_eq!(fs::read(&main).unwrap(), b"old");
        let files = output.finish().unwrap();
        assert_eq!(files.len(), 2);
        assert_eq!(files.last().unwrap(), &(main.clone(), 3));
        assert_eq!(fs::read(&main).unwrap(), b"new");
        assert_eq!(names(&folder.path().join("images")), ["a.png"]);
    }

    #[test]
    fn an_error_of_writing_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let mut output = Output::new(&file.join("map.glb"));
        let problem = output.write_main(b"x").unwrap_err().to_string();
        assert!(problem.contains("file"), "{problem}");
    }
}
