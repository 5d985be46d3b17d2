//! The engine's services, for any engine.
//!
//! A front end fills a [`Table`] from its engine's table and installs it here. The rest of the library calls the engine
//! by the methods of [`Engine`]. This module uses no other module of this crate but [`abi`](crate::abi).
//!
//! Services are called only on the engine's main thread. Each may leave by `longjmp` on an error of the engine: see
//! [`boundary`](crate::boundary#services-that-do-not-return).

mod services;

use crate::abi::functions as f;
use crate::abi::{QBool, glconfig_t};
use relight::Precedence;
use std::borrow::Cow;
use std::cell::UnsafeCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// A console variable of the engine. The front end of that engine defines its type.
#[derive(Clone, Copy, Debug)]
pub struct Variable(NonNull<c_void>);

impl Variable {
    /// The engine's pointer.
    pub fn as_ptr(self) -> *mut c_void {
        self.0.as_ptr()
    }
}

/// Offsets of members of the engine's `cvar_t`, bytes.
#[derive(Clone, Copy, Debug)]
pub struct VariableLayout {
    /// `char *string`.
    pub string: usize,
    /// `qboolean modified`, or a `bool`: 0 or 1 in the first byte; the others are not used.
    pub modified: usize,
    /// `float value`.
    pub value: usize,
    /// `int integer`.
    pub integer: usize,
}

/// The layout of an engine's `cvar_t`.
macro_rules! variable_layout {
    ($cvar:ty) => {
        $crate::engine::VariableLayout {
            string: std::mem::offset_of!($cvar, string),
            modified: std::mem::offset_of!($cvar, modified),
            value: std::mem::offset_of!($cvar, value),
            integer: std::mem::offset_of!($cvar, integer),
        }
    };
}
pub(crate) use variable_layout;

/// What is particular to an engine, besides its tables: a row of the list of front ends.
#[derive(Debug)]
pub struct FrontEnd {
    /// Name in messages, and in the environment variable that selects a front end.
    pub name: &'static str,
    /// Beginnings of renderers' file names that only this engine uses.
    pub files: &'static [&'static str],
    /// Text that only this engine's executable contains, spelled backwards, so that a program linked with this library
    /// does not contain it.
    pub marker: Option<&'static str>,
    /// Whether the installed table is this engine's. Called for engines without a file name or a marker of their own.
    /// These engines have `Cvar_Get`, `Cvar_VariableIntegerValue` and the first members of a variable in the same places.
    pub recognizes: Option<fn(Engine) -> bool>,
    /// Entries of its table of services.
    pub services: usize,
    /// Number of entries, from the first, that are functions or null; later entries may be anything.
    pub called: usize,
    /// Fills a [`Table`] from the engine's table, installs it and copies what else the front end needs.
    ///
    /// # Safety
    /// The pointer must be to this engine's table, whose functions must be callable until the process ends. The call
    /// must come from the engine's main thread while no other call of ours runs.
    pub install: unsafe fn(*const c_void) -> Engine,
    /// The table of our functions for this engine.
    pub exports: fn() -> *const c_void,
    /// Entries of that table; the first is `Shutdown` in all engines.
    pub functions: usize,
    /// `cl_renderer` of its own OpenGL renderers, best first.
    pub opengl: &'static [&'static str],
    /// File names of its renderers: `NAME` is `cl_renderer`, `ARCH` the architecture, without a suffix.
    pub libraries: &'static [&'static str],
    /// Folders with its renderers on systems that install it, searched after our own and the program's.
    pub folders: &'static [&'static str],
    /// Name of the variable with the game's own folder.
    pub base_game: &'static CStr,
    /// Defaults of variables where they differ from the table's.
    pub defaults: &'static [(&'static str, &'static str)],
    /// Variables that the engine registers itself: their flags, limits and descriptions are its own.
    pub owned: &'static [&'static str],
    /// Endings of further files with materials, beside `.shader`.
    pub scripts: &'static [&'static CStr],
    /// The definition that the engine takes among several of one name.
    pub precedence: Precedence,
}

/// Functions of an engine that makes the window itself.
#[derive(Clone, Copy, Debug)]
pub struct WindowServices {
    /// Opens the window, starts the input code, fills the window's part of the structure and keeps the pointer. Closes
    /// a window that is open.
    pub open: unsafe extern "C" fn(*mut glconfig_t),
    /// Closes the window; true: for good.
    pub close: unsafe extern "C" fn(QBool),
    /// `vkGetInstanceProcAddr` of the loader that the window was made for.
    pub instance_function: unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void,
    /// Makes a surface of the window.
    pub create_surface: unsafe extern "C" fn(*mut c_void, *mut u64) -> QBool,
    /// Whether the window is minimized.
    pub is_minimized: Option<unsafe extern "C" fn() -> QBool>,
    /// The structure that the engine writes to while the window is open.
    pub config: *mut glconfig_t,
}

macro_rules! table {
    ($( $(#[$meta:meta])* $field:ident: $type:ty; )*) => {
        /// The services of an engine, in one shape for all engines. Entries that the engine does not have are `None`:
        /// they do nothing and return an empty value.
        #[derive(Clone, Copy, Debug)]
        #[allow(missing_docs)] // the functions have the engines' names
        pub struct Table {
            /// The engine; `None` before it is recognized.
            pub front_end: Option<&'static FrontEnd>,
            /// Layout of its variables.
            pub variable: VariableLayout,
            $( $(#[$meta])* pub $field: Option<$type>, )*
        }

        impl Table {
            /// No services.
            pub const EMPTY: Table = Table {
                front_end: None,
                variable: VariableLayout { string: 0, modified: 0, value: 0, integer: 0 },
                $( $field: None, )*
            };
        }
    };
}

table! {
    printf: f::Printf;
    error: f::Error;
    milliseconds: f::Milliseconds;
    cvar_get: f::Cvar_Get;
    cvar_set: f::Cvar_Set;
    cvar_check_range: f::Cvar_CheckRange;
    cvar_set_description: f::Cvar_SetDescription;
    cvar_variable_integer_value: f::Cvar_VariableIntegerValue;
    /// Text of a variable, which is not made if there is none.
    cvar_variable_string: unsafe extern "C" fn(*const c_char) -> *const c_char;
    cmd_add_command: f::Cmd_AddCommand;
    cmd_remove_command: f::Cmd_RemoveCommand;
    cmd_argc: f::Cmd_Argc;
    cmd_argv: f::Cmd_Argv;
    cmd_execute_text: f::Cmd_ExecuteText;
    cm_cluster_pvs: f::CM_ClusterPVS;
    cm_draw_debug_surface: f::CM_DrawDebugSurface;
    fs_read_file: f::FS_ReadFile;
    fs_free_file: f::FS_FreeFile;
    fs_list_files: f::FS_ListFiles;
    fs_free_file_list: f::FS_FreeFileList;
    fs_write_file: f::FS_WriteFile;
    fs_file_exists: f::FS_FileExists;
    cin_upload_cinematic: f::CIN_UploadCinematic;
    cin_play_cinematic: f::CIN_PlayCinematic;
    cin_run_cinematic: f::CIN_RunCinematic;
    cl_write_avi_video_frame: f::CL_WriteAVIVideoFrame;
    in_init: f::IN_Init;
    in_shutdown: f::IN_Shutdown;
    in_restart: f::IN_Restart;
    sys_glimp_safe_init: f::Sys_GLimpSafeInit;
    sys_glimp_init: f::Sys_GLimpInit;
    /// Frees the memory that the renderer got from the engine.
    free_all: unsafe extern "C" fn();
    /// For engines that make the window themselves.
    window: WindowServices;
}

/// The services that all known engines have with the same types.
macro_rules! common_services {
    ($from:expr) => {
        $crate::engine::Table {
            printf: $from.Printf,
            error: $from.Error,
            milliseconds: $from.Milliseconds,
            cvar_get: $from.Cvar_Get,
            cvar_set: $from.Cvar_Set,
            cvar_variable_integer_value: $from.Cvar_VariableIntegerValue,
            cmd_add_command: $from.Cmd_AddCommand,
            cmd_remove_command: $from.Cmd_RemoveCommand,
            cmd_argc: $from.Cmd_Argc,
            cmd_argv: $from.Cmd_Argv,
            cmd_execute_text: $from.Cmd_ExecuteText,
            cm_cluster_pvs: $from.CM_ClusterPVS,
            cm_draw_debug_surface: $from.CM_DrawDebugSurface,
            fs_free_file: $from.FS_FreeFile,
            fs_list_files: $from.FS_ListFiles,
            fs_free_file_list: $from.FS_FreeFileList,
            fs_write_file: $from.FS_WriteFile,
            fs_file_exists: $from.FS_FileExists,
            cin_upload_cinematic: $from.CIN_UploadCinematic,
            cin_play_cinematic: $from.CIN_PlayCinematic,
            cin_run_cinematic: $from.CIN_RunCinematic,
            cl_write_avi_video_frame: $from.CL_WriteAVIVideoFrame,
            ..$crate::engine::Table::EMPTY
        }
    };
}
pub(crate) use common_services;

/// The services of engines whose renderer makes the window.
macro_rules! renderer_made_window {
    ($from:expr) => {
        $crate::engine::Table {
            cvar_check_range: $from.Cvar_CheckRange,
            fs_read_file: $from.FS_ReadFile,
            in_init: $from.IN_Init,
            in_shutdown: $from.IN_Shutdown,
            in_restart: $from.IN_Restart,
            sys_glimp_safe_init: $from.Sys_GLimpSafeInit,
            sys_glimp_init: $from.Sys_GLimpInit,
            ..$crate::engine::common_services!($from)
        }
    };
}
pub(crate) use renderer_made_window;

/// The loading engine. A token: its table is a static, replaced by each `GetRefAPI`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Engine(());

/// A static that the engine's main thread alone uses.
pub struct MainThread<T>(pub UnsafeCell<T>);

// SAFETY: `GetRefAPI` and calls of the engine use it, all on the engine's main thread: `boundary::entry` refuses all
// other threads earlier.
unsafe impl<T> Sync for MainThread<T> {}

static TABLE: MainThread<Table> = MainThread(UnsafeCell::new(Table::EMPTY));
static INSTALLED: AtomicBool = AtomicBool::new(false);

/// Sets the services of the loading engine.
///
/// # Safety
/// Every function of the table must be callable until the process ends. This must run on the engine's main thread while
/// no other call of ours runs.
pub unsafe fn install(table: Table) -> Engine {
    // SAFETY: no other call of ours runs, and this is the main thread, by this function's contract: no other code
    // accesses the table.
    unsafe { *TABLE.0.get() = table };
    INSTALLED.store(true, Ordering::Release);
    Engine(())
}

/// The engine of the last `GetRefAPI`, if there was one.
pub fn current() -> Option<Engine> {
    INSTALLED.load(Ordering::Acquire).then_some(Engine(()))
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
