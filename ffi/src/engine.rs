//! The engine's services, for any engine.
//!
//! A front end (`ioq3`) implements [`Services`] with its engine's table and installs itself here. The rest of the
//! library calls the engine through this module, which uses no other module of this crate.
//!
//! Services are called only on the engine's main thread. Each may leave by `longjmp` on an error of the engine: see
//! [`boundary`](crate::boundary#services-that-do-not-return).

use std::borrow::Cow;
use std::ffi::{CStr, CString, c_char, c_float, c_int, c_uchar, c_void};
use std::fmt::Debug;
use std::ptr::NonNull;
use std::sync::{Mutex, PoisonError};

/// `printParm_t`, with the numbers of all engines of the family.
#[allow(missing_docs)]
pub mod print {
    use std::ffi::c_int;
    pub const ALL: c_int = 0;
    pub const DEVELOPER: c_int = 1;
    pub const WARNING: c_int = 2;
    pub const ERROR: c_int = 3;
}

/// `errorParm_t`, with the numbers of all engines of the family: effects of `ri.Error`.
#[allow(missing_docs)]
pub mod error_level {
    use std::ffi::c_int;
    /// The process ends.
    pub const FATAL: c_int = 0;
    /// Back to the menu.
    pub const DROP: c_int = 1;
}

/// `cvar_t::flags`, with the numbers of all engines of the family.
#[allow(missing_docs)]
pub mod cvar_flags {
    use std::ffi::c_int;
    pub const ARCHIVE: c_int = 0x1;
    pub const LATCH: c_int = 0x20;
    pub const ROM: c_int = 0x40;
    pub const TEMP: c_int = 0x100;
    pub const CHEAT: c_int = 0x200;
}

/// Limit of game paths, bytes, including the NUL.
pub const MAX_QPATH: usize = 64;

/// A console variable of the engine. Its type is defined by the front end of that engine.
#[derive(Clone, Copy, Debug)]
pub struct Variable(NonNull<c_void>);

impl Variable {
    /// A cvar; `None` for null.
    ///
    /// # Safety
    /// `cvar` must be null or a variable from the installed engine's table, which must stay valid until the process
    /// ends.
    pub unsafe fn new(cvar: *mut c_void) -> Option<Self> {
        NonNull::new(cvar).map(Self)
    }

    /// The engine's pointer.
    pub fn as_ptr(self) -> *mut c_void {
        self.0.as_ptr()
    }
}

/// Services of an engine for its renderer. A service that is missing in the engine's table does nothing and returns an
/// empty value.
pub trait Services: Debug + Sync {
    /// Prints text. `level`: one of [`mod@print`].
    fn print(&self, level: c_int, text: &str);

    /// Prints to the console and the log.
    fn say(&self, text: &str) {
        self.print(print::ALL, text);
    }

    /// The engine's error function, which does not return.
    fn error_function(&self) -> Option<unsafe extern "C" fn(c_int, *const c_char, ...)>;

    /// Engine time in milliseconds (scaled by `timescale`).
    fn milliseconds(&self) -> c_int;

    /// Finds or makes a variable; applies its latched value. `None` if the engine has no such service.
    fn cvar_get(&self, name: &CStr, default: &CStr, flags: c_int) -> Option<Variable>;

    /// Text of a variable of the engine; empty if there is none.
    fn cvar_text(&self, name: &CStr) -> String {
        self.cvar_get(name, c"", 0)
            .map_or_else(String::new, |cvar| self.cvar_string(cvar))
    }

    /// Sets a variable, regardless of its flags.
    fn cvar_set(&self, name: &CStr, value: &str);

    /// The value as an integer, as parsed by the engine.
    fn cvar_as_integer(&self, cvar: Variable) -> c_int;

    /// The value as a number, which may be infinite or NaN.
    fn cvar_as_number(&self, cvar: Variable) -> f32;

    /// The value as text.
    fn cvar_string(&self, cvar: Variable) -> String;

    /// Whether the value has changed since [`Services::cvar_seen`].
    fn cvar_modified(&self, cvar: Variable) -> bool;

    /// Marks a change as processed, which is the duty of a variable's owner.
    fn cvar_seen(&self, cvar: Variable);

    /// Limits a variable to a range from now on.
    fn cvar_check_range(&self, cvar: Variable, min: f32, max: f32, integral: bool);

    /// Sets the help text of a variable.
    fn cvar_describe(&self, cvar: Variable, text: &CStr);

    /// Integer value of any variable; 0 if there is none.
    fn cvar_integer(&self, name: &CStr) -> c_int;

    /// Adds a console command. An existing command of that name keeps its function.
    fn add_command(&self, name: &CStr, function: unsafe extern "C" fn());

    /// Removes a console command, if it exists.
    fn remove_command(&self, name: &CStr);

    /// The words of the running command; the first is its name.
    fn arguments(&self) -> Vec<String>;

    /// Appends text to the engine's command buffer.
    fn append_command(&self, text: &CStr);

    /// Whether cluster `to` is visible from cluster `from` by the collision model's visibility data; both must be
    /// clusters of the loaded map.
    fn cluster_sees(&self, from: i32, to: i32) -> bool;

    /// Reads a whole game file; `None` if it does not exist.
    ///
    /// The name must have passed [`valid_game_path`].
    fn read_file(&self, name: &CStr) -> Option<Vec<u8>>;

    /// Whether a game file exists, in packs or folders.
    fn has_file(&self, name: &CStr) -> bool;

    /// Files in a folder, in the engine's order.
    fn list_files(&self, directory: &CStr, extension: &CStr) -> Vec<String>;

    /// Writes a file in the user's game folder. Returns whether the file exists afterwards: the engine refuses some
    /// names without a result.
    fn write_file(&self, name: &str, contents: &[u8]) -> bool;

    /// Whether the user's game folder contains this file (packs are not searched).
    fn home_file_exists(&self, name: &CStr) -> bool;

    /// Starts a video for a material. `None` if it cannot be played.
    fn play_cinematic(&self, name: &CStr) -> Option<c_int>;

    /// Decodes a video up to the present time. The engine calls `UploadCinematic` during the call.
    fn run_cinematic(&self, handle: c_int);

    /// Draws the polygons of the engine's collision debugging; the engine calls `polygon` for each during the call.
    fn draw_debug_surface(&self, polygon: unsafe extern "C" fn(c_int, c_int, *mut c_float));

    /// Appends a frame to the video that the engine records.
    ///
    /// # Safety
    /// `length` bytes must be readable at `data`.
    unsafe fn write_avi_frame(&self, data: *const c_uchar, length: c_int);

    /// Passes the window to the engine's input code.
    ///
    /// # Safety
    /// `window` must be an `SDL_Window` of the process's SDL, valid until [`Services::input_shutdown`].
    unsafe fn input_init(&self, window: *mut c_void);

    /// Ends the use of the window by the engine's input code.
    fn input_shutdown(&self);

    /// Restarts the input code on the same window.
    fn input_restart(&self);

    /// Notifies the engine that video will start. No effect in present engines.
    fn video_init_hook(&self, safe: bool);
}

/// The services of the loading engine.
pub type Engine = &'static dyn Services;

static CURRENT: Mutex<Option<Engine>> = Mutex::new(None);

/// Sets the loading engine.
pub fn install(engine: Engine) {
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner) = Some(engine);
}

/// The engine of the last `GetRefAPI`, if there was one.
pub fn current() -> Option<Engine> {
    *CURRENT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Copies a C string; null gives an empty string. Bytes that are not UTF-8 are replaced.
///
/// # Safety
/// `text` must be null or point at a NUL-terminated string.
pub unsafe fn string_from(text: *const c_char) -> String {
    // SAFETY: null or NUL-terminated by this function's contract; copied at once, so nothing borrows it later.
    unsafe { text_of(text) }.into_owned()
}

/// Borrows a C string; null gives an empty string. Bytes that are not UTF-8 are replaced, in a copy.
///
/// # Safety
/// `text` must be null or point at a NUL-terminated string, which must be unchanged while the result is used.
pub unsafe fn text_of<'a>(text: *const c_char) -> Cow<'a, str> {
    if text.is_null() {
        return Cow::Borrowed("");
    }
    // SAFETY: not null, so NUL-terminated and unchanged while the result is used, by this function's contract.
    unsafe { CStr::from_ptr(text) }.to_string_lossy()
}

/// A name that is valid for the engine's file functions: not empty, shorter than the engine's limit for game paths,
/// without NUL. An empty name would end the process.
pub fn valid_game_path(name: &str) -> Option<CString> {
    if name.is_empty() || name.len() >= MAX_QPATH {
        return None;
    }
    CString::new(name).ok()
}

/// A name that the engine writes to: a valid one inside of the game's folder. The engine refuses others, at best with a
/// message of its own.
pub fn valid_path_to_write(name: &str) -> Option<CString> {
    let leaves = name.contains("..") || name.contains("::") || name.starts_with(['/', '\\']);
    valid_game_path(name).filter(|_| !leaves)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_end_the_process_are_refused() {
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
