//! The engine's file system as the renderer's trait.

use crate::engine::{Engine, valid_game_path};
use crate::session;
use relight::{FileError, GameFiles, Precedence};
use std::ffi::CString;

/// Game files as the engine finds them: in its packs and folders, by its download rules.
///
/// For use on the engine's main thread only, as the trait allows.
#[derive(Debug)]
pub struct EngineFiles {
    engine: Engine,
    /// Of the window, pixels.
    size: (u32, u32),
}

impl EngineFiles {
    /// Files of `engine`, whose window has this size, pixels.
    pub fn new(engine: Engine, size: (u32, u32)) -> Self {
        Self { engine, size }
    }

    /// `path` as a valid argument of the engine's services.
    fn checked(path: &str) -> Result<CString, FileError> {
        let usable = if session::on_main_thread() {
            valid_game_path(path)
        } else {
            None
        };
        usable.ok_or_else(|| FileError::Refused {
            path: path.to_string(),
        })
    }
}

impl GameFiles for EngineFiles {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        Ok(self.engine.read_file(&Self::checked(path)?))
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        // An empty folder name is the game folder itself, which the engine accepts here but not for reading.
        let dir = if dir.is_empty() {
            Some(CString::default())
        } else {
            Self::checked(dir).ok()
        };
        // The engine compares name endings: without the dot, `menushader` would match `shader`.
        let suffix = if extension.is_empty() || extension.starts_with('.') {
            extension.to_string()
        } else {
            format!(".{extension}")
        };
        match (dir, CString::new(suffix)) {
            (Some(dir), Ok(extension)) if session::on_main_thread() => {
                let mut names = Vec::new();
                let is_scripts = dir.as_c_str() == c"scripts" && extension.as_c_str() == c".shader";
                let front = self.engine.front_end().filter(|_| is_scripts);
                for more in front.map_or(&[][..], |front| front.scripts) {
                    names.extend(self.engine.list_files(&dir, more));
                }
                names.extend(self.engine.list_files(&dir, &extension));
                names
            }
            _ => Vec::new(),
        }
    }

    fn variable(&self, name: &str) -> String {
        match name.to_ascii_lowercase().as_str() {
            "vid_width" => self.size.0.to_string(),
            "vid_height" => self.size.1.to_string(),
            _ if session::on_main_thread() => self.engine.cvar_text_if_any(name),
            _ => String::new(),
        }
    }

    fn precedence(&self) -> Precedence {
        let front = self.engine.front_end();
        front.map_or(Precedence::default(), |front| front.precedence)
    }

    fn exists(&self, path: &str) -> bool {
        Self::checked(path).is_ok_and(|name| self.engine.has_file(&name))
    }
}
