//! What a test sets and reads between frames: console variables, the clock, files, messages, broken rules.

use std::path::Path;

use super::abi::glconfig_t;
use super::imports::{self, Film, Message};
use super::{Engine, is_validation};

impl Engine {
    /// `set NAME VALUE` on the console.
    pub fn set(&mut self, name: &str, value: &str) {
        imports::with(|s| s.cvars.set_by_user(name, value));
    }

    /// Sets the engine's clock, which stands still from then on.
    pub fn set_clock(&mut self, milliseconds: i32) {
        imports::with(|s| s.clock = Some(milliseconds));
    }

    /// What every film shows: a square of `side` pixels, a power of two. The engine's own have 256.
    ///
    /// # Panics
    /// When `rgba` is no such picture.
    pub fn set_film(&mut self, side: i32, rgba: Vec<u8>) {
        assert_eq!(rgba.len(), (side * side * 4) as usize);
        let rgba = rgba.into();
        imports::with(|s| s.film = Film { side, rgba });
    }

    /// A console variable's value, if it exists.
    pub fn cvar(&self, name: &str) -> Option<String> {
        imports::with(|s| s.cvars.string(name)).flatten()
    }

    /// Names of the console variables that the renderer registered.
    pub fn registered_cvars(&self) -> Vec<String> {
        imports::with(|s| s.cvars.registered()).unwrap_or_default()
    }

    /// A console variable's flags, reset value and description.
    pub fn describe_cvar(&self, name: &str) -> Option<(i32, String, Option<String>)> {
        imports::with(|s| s.cvars.describe(name)).flatten()
    }

    /// Names of the commands that exist.
    pub fn commands(&self) -> Vec<String> {
        let mut names: Vec<String> =
            imports::with(|s| s.commands.keys().cloned().collect()).unwrap_or_default();
        names.sort();
        names
    }

    /// What the renderer wrote about itself.
    pub fn config(&self) -> glconfig_t {
        // SAFETY: numbers and characters alone.
        imports::with(|s| *s.config).unwrap_or_else(|| unsafe { std::mem::zeroed() })
    }

    /// Makes reading this file an error of the engine, and of no other file.
    pub fn set_damaged(&mut self, name: Option<&str>) {
        imports::with(|s| s.damaged = name.map(str::to_owned));
    }

    /// Adds or replaces a game file.
    pub fn insert_file(&mut self, name: &str, bytes: Vec<u8>) {
        imports::with(|s| s.files.insert(name, bytes));
    }

    /// A game file's bytes, or those of one that the renderer has written.
    pub fn read_file(&self, name: &str) -> Option<Vec<u8>> {
        imports::with(|s| s.files.read(name)).flatten()
    }

    /// From now on only packs are read, as on a pure server.
    pub fn read_packs_only(&mut self) {
        imports::with(|s| s.files.read_packs_only());
    }

    /// What `FS_ListFiles` gives.
    pub fn list_files(&self, dir: &str, extension: &str) -> Vec<String> {
        imports::with(|s| s.files.list(dir, extension)).unwrap_or_default()
    }

    /// The folder that `FS_WriteFile` writes to.
    pub fn home(&self) -> &Path {
        self.home.path()
    }

    /// Takes the messages since the last call.
    pub fn take_messages(&mut self) -> Vec<Message> {
        imports::with(|s| std::mem::take(&mut s.messages)).unwrap_or_default()
    }

    /// All messages that have not been taken.
    pub fn messages(&self) -> Vec<Message> {
        imports::with(|s| s.messages.clone()).unwrap_or_default()
    }

    /// Takes the frames that the video writer got.
    pub fn take_video(&mut self) -> Vec<Vec<u8>> {
        imports::with(|s| std::mem::take(&mut s.video)).unwrap_or_default()
    }

    /// What the renderer did against the engine's rules: temporary memory freed in the wrong order, commands added
    /// twice or left behind, memory freed that is none, errors inside errors, forbidden arguments.
    pub fn violations(&self) -> Vec<String> {
        let mut all = imports::with(|s| s.memory.violations.clone()).unwrap_or_default();
        let lists = imports::with(|s| s.lists.len()).unwrap_or(0);
        if lists > 0 {
            all.push(format!("{lists} file lists were never freed"));
        }
        all
    }

    /// Messages of Vulkan's validation layers.
    pub fn validation_messages(&self) -> Vec<String> {
        self.messages()
            .into_iter()
            .map(|m| m.text)
            .filter(|t| is_validation(t))
            .collect()
    }

    /// Fails the test if the renderer broke a rule or the validation layers had to say something.
    ///
    /// # Panics
    /// Then.
    pub fn assert_clean(&self) {
        assert_eq!(self.violations(), Vec::<String>::new());
        assert_eq!(self.validation_messages(), Vec::<String>::new());
    }

    /// What happened to a window that the engine makes, since the last call.
    pub fn take_window_events(&mut self) -> Vec<String> {
        imports::with(|s| std::mem::take(&mut s.window_events)).unwrap_or_default()
    }
}
