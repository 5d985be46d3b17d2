//! The engine's services, whatever engine loaded us.
//!
//! A front end (`ioq3`) implements [`Services`] over the table that its engine hands over, and installs itself here.
//! The rest of the library calls the engine through this module, which uses no other one of this crate.
//!
//! Services are called on the engine's main thread alone. Each may leave by `longjmp` when the engine meets an error of
//! its own: see [`boundary`](crate::boundary#services-that-do-not-return).

use std::borrow::Cow;
use std::ffi::{CStr, CString, c_char, c_float, c_int, c_uchar, c_void};
use std::fmt::Debug;
use std::ptr::NonNull;
use std::sync::{Mutex, PoisonError};

/// `printParm_t`, as all engines of the family number it.
#[allow(missing_docs)]
pub mod print {
    use std::ffi::c_int;
    pub const ALL: c_int = 0;
    pub const DEVELOPER: c_int = 1;
    pub const WARNING: c_int = 2;
    pub const ERROR: c_int = 3;
}

/// `errorParm_t`, as all engines of the family number it: what `ri.Error` does.
#[allow(missing_docs)]
pub mod error_level {
    use std::ffi::c_int;
    /// The process ends.
    pub const FATAL: c_int = 0;
    /// Back to the menu.
    pub const DROP: c_int = 1;
}

/// `cvar_t::flags`, as all engines of the family number them.
#[allow(missing_docs)]
pub mod cvar_flags {
    use std::ffi::c_int;
    pub const ARCHIVE: c_int = 0x1;
    pub const LATCH: c_int = 0x20;
    pub const ROM: c_int = 0x40;
    pub const TEMP: c_int = 0x100;
    pub const CHEAT: c_int = 0x200;
}

/// Game paths have to be shorter than this, in bytes.
pub const MAX_QPATH: usize = 64;

/// A console variable of the engine. Only the front end whose engine made it knows what is behind it.
#[derive(Clone, Copy, Debug)]
pub struct Variable(NonNull<c_void>);

impl Variable {
    /// A cvar; `None` for null.
    ///
    /// # Safety
    /// `cvar` must be null or a variable that the installed engine's table answered, which must stay one for as long as
    /// the process lives.
    pub unsafe fn new(cvar: *mut c_void) -> Option<Self> {
        NonNull::new(cvar).map(Self)
    }

    /// What the engine knows it by.
    pub fn as_ptr(self) -> *mut c_void {
        self.0.as_ptr()
    }
}

/// What an engine does for its renderer. A service that is missing from the engine's table does nothing and answers
/// nothing.
pub trait Services: Debug + Sync {
    /// Prints. `level` is one of [`mod@print`].
    fn print(&self, level: c_int, text: &str);

    /// Prints to the console and the log.
    fn say(&self, text: &str) {
        self.print(print::ALL, text);
    }

    /// The engine's error function. Calling it never returns to the caller.
    fn error_function(&self) -> Option<unsafe extern "C" fn(c_int, *const c_char, ...)>;

    /// Engine time in milliseconds (scaled by `timescale`).
    fn milliseconds(&self) -> c_int;

    /// Finds or makes a cvar; applies its latched value. `None` when the engine has no such service.
    fn cvar_get(&self, name: &CStr, default: &CStr, flags: c_int) -> Option<Variable>;

    /// The text of a variable that belongs to the engine; empty where there is none.
    fn cvar_text(&self, name: &CStr) -> String {
        self.cvar_get(name, c"", 0)
            .map_or_else(String::new, |cvar| self.cvar_string(cvar))
    }

    /// Sets a cvar, whatever its flags.
    fn cvar_set(&self, name: &CStr, value: &str);

    /// The value as an integer, as the engine parsed it.
    fn cvar_as_integer(&self, cvar: Variable) -> c_int;

    /// The value as a number, which may be infinite or NaN.
    fn cvar_as_number(&self, cvar: Variable) -> f32;

    /// The value as text.
    fn cvar_string(&self, cvar: Variable) -> String;

    /// Whether the value changed since [`Services::cvar_seen`].
    fn cvar_modified(&self, cvar: Variable) -> bool;

    /// Marks the change as consumed, which is the part of a cvar's owner.
    fn cvar_seen(&self, cvar: Variable);

    /// Keeps a cvar within a range from now on.
    fn cvar_check_range(&self, cvar: Variable, min: f32, max: f32, integral: bool);

    /// Sets the text that the console shows for a cvar.
    fn cvar_describe(&self, cvar: Variable, text: &CStr);

    /// Integer value of any cvar; 0 if there is none.
    fn cvar_integer(&self, name: &CStr) -> c_int;

    /// Adds a console command. If there is one of that name, the old function stays.
    fn add_command(&self, name: &CStr, function: unsafe extern "C" fn());

    /// Removes a console command; one that is not there is no error.
    fn remove_command(&self, name: &CStr);

    /// The words of the command that runs now; the first is its name.
    fn arguments(&self) -> Vec<String>;

    /// Appends to the engine's command buffer.
    fn append_command(&self, text: &CStr);

    /// Asks the collision model's visibility whether `from` sees `to`, both clusters of the loaded map.
    fn cluster_sees(&self, from: i32, to: i32) -> bool;

    /// Reads a game file whole. `None` if it is not there.
    ///
    /// The name must have passed [`valid_game_path`].
    fn read_file(&self, name: &CStr) -> Option<Vec<u8>>;

    /// Whether a game file is there, in packs or folders, without reading it.
    fn has_file(&self, name: &CStr) -> bool;

    /// Files of a folder, in the engine's order.
    fn list_files(&self, directory: &CStr, extension: &CStr) -> Vec<String>;

    /// Writes below the user's game folder. Returns whether the file is there then: the engine refuses some names and
    /// has nothing to answer.
    fn write_file(&self, name: &str, contents: &[u8]) -> bool;

    /// Whether the user's game folder has this file (packs are not searched).
    fn home_file_exists(&self, name: &CStr) -> bool;

    /// Starts a video for a material. `None` if it cannot be played.
    fn play_cinematic(&self, name: &CStr) -> Option<c_int>;

    /// Lets a video go on to the present and upload its picture. The engine calls `UploadCinematic` from inside.
    fn run_cinematic(&self, handle: c_int);

    /// Lets the collision code show what it wants to; it calls `polygon` from inside, for each.
    fn draw_debug_surface(&self, polygon: unsafe extern "C" fn(c_int, c_int, *mut c_float));

    /// Appends a frame to the video that the engine records.
    ///
    /// # Safety
    /// `length` bytes must be readable at `data`.
    unsafe fn write_avi_frame(&self, data: *const c_uchar, length: c_int);

    /// Gives the window to the engine's input code.
    ///
    /// # Safety
    /// `window` must be an `SDL_Window` of the process's SDL, valid until [`Services::input_shutdown`].
    unsafe fn input_init(&self, window: *mut c_void);

    /// Takes the window away from the engine's input code.
    fn input_shutdown(&self);

    /// Lets the input code start again on the same window.
    fn input_restart(&self);

    /// Tells the engine that video is about to start. Does nothing in today's engines.
    fn video_init_hook(&self, safe: bool);
}

/// The services of the engine that loaded us.
pub type Engine = &'static dyn Services;

static CURRENT: Mutex<Option<Engine>> = Mutex::new(None);

/// From now on `engine` is the one that loaded us.
pub fn install(engine: Engine) {
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner) = Some(engine);
}

/// The engine of the newest `GetRefAPI`, if there was one.
pub fn current() -> Option<Engine> {
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Copies a C string; null is empty. Bytes that are not UTF-8 are replaced.
///
/// # Safety
/// `text` must be null or point at a NUL-terminated string.
pub unsafe fn string_from(text: *const c_char) -> String {
    // SAFETY: null or NUL-terminated by this function's contract; copied at once, so nothing borrows it later.
    unsafe { text_of(text) }.into_owned()
}

/// A C string where it lies; null is empty. Bytes that are not UTF-8 are replaced, in a copy.
///
/// # Safety
/// `text` must be null or point at a NUL-terminated string, which must stay as it is for as long as the answer is used.
pub unsafe fn text_of<'a>(text: *const c_char) -> Cow<'a, str> {
    if text.is_null() {
        return Cow::Borrowed("");
    }
    // SAFETY: not null, so NUL-terminated and unchanged while the answer is used, by this function's contract.
    unsafe { CStr::from_ptr(text) }.to_string_lossy()
}

/// A name that can be handed to the engine's file functions: not empty, shorter than the engine's limit for game
/// paths, without NUL. An empty name would end the process.
pub fn valid_game_path(name: &str) -> Option<CString> {
    if name.is_empty() || name.len() >= MAX_QPATH {
        return None;
    }
    CString::new(name).ok()
}

/// A name that the engine writes to: a valid one that stays in the game's folder. The engine refuses the others, in a
/// line of its own at best.
pub fn valid_path_to_write(name: &str) -> Option<CString> {
    let leaves = name.contains("..") || name.contains("::") || name.starts_with(['/', '\\']);
    valid_game_path(name).filter(|_| !leaves)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_the_engine_would_die_of_are_refused() {
        assert!(valid_game_path("").is_none());
        assert!(valid_game_path("a\0b").is_none());
        assert!(valid_game_path(&"x".repeat(64)).is_none());
        assert!(valid_game_path(&"x".repeat(63)).is_some());
    }

    #[test]
    fn only_names_inside_the_games_folder_are_written_to() {
        for name in ["", "../a", "a/../../b", "a..b", "a::b", "/tmp/a", "\\a"] {
            assert!(valid_path_to_write(name).is_none(), "{name}");
        }
        assert!(valid_path_to_write("screenshots/a.b.tga").is_some());
    }
}
