//! The services as methods; raw pointers and C strings stay inside of this module.
//!
//! Every service may leave by `longjmp` on an error of the engine. The calls here have no destructor on the stack that
//! correctness depends on; only memory can leak in this case.

use super::{
    Engine, FrontEnd, TABLE, Table, Variable, VariableLayout, WindowServices, print, string_from,
    valid_path_to_write,
};
use crate::abi::{CIN_MATERIAL, EXEC_APPEND, EXEC_INSERT, is_true};
use crate::system;
use std::ffi::{CStr, CString, c_char, c_float, c_int, c_uchar, c_void};
use std::num::IntErrorKind;
use std::path::PathBuf;
use std::ptr::{self, NonNull};

/// Passes the pieces of `text` to `f`, each short enough for the engine's print buffer and NUL-terminated.
///
/// The buffer is on the stack, so that nothing leaks if `f` does not return.
fn in_c_pieces(text: &str, mut f: impl FnMut(*const c_char)) {
    // The engine formats into 4096 bytes.
    const PIECE: usize = 3500;
    let mut rest = text;
    while !rest.is_empty() {
        let mut end = rest.len().min(PIECE);
        while !rest.is_char_boundary(end) {
            end -= 1;
        }
        let (piece, tail) = rest.split_at(end);
        let mut buffer = [0u8; PIECE + 1];
        for (to, from) in buffer.iter_mut().zip(piece.bytes()) {
            *to = if from == 0 { b'?' } else { from };
        }
        f(buffer.as_ptr().cast());
        rest = tail;
    }
}

/// The number at the start of the text, as C's `atoi` reads it: 0 if there is none, `None` if it is out of range, for
/// which C defines no result.
fn whole_number(text: &str) -> Option<c_int> {
    let text = text.trim_start();
    let is_part =
        |(at, c): &(usize, char)| c.is_ascii_digit() || *at == 0 && matches!(c, '+' | '-');
    let end = text.char_indices().take_while(is_part).count();
    match text.get(..end).unwrap_or_default().parse() {
        Ok(number) => Some(number),
        Err(error) => match error.kind() {
            IntErrorKind::PosOverflow | IntErrorKind::NegOverflow => None,
            _ => Some(0),
        },
    }
}

/// A service that is missing in the engine's table does nothing and returns an empty value.
impl Engine {
    /// One entry of the table.
    fn get<T>(self, pick: impl FnOnce(&Table) -> T) -> T {
        // SAFETY: main thread only; the reference ends with this expression.
        pick(unsafe { &*TABLE.0.get() })
    }

    /// What is particular to the engine; `None` before it is recognized.
    pub fn front_end(self) -> Option<&'static FrontEnd> {
        self.get(|t| t.front_end)
    }

    /// Functions for the window, if the engine makes it.
    pub fn window(self) -> Option<WindowServices> {
        self.get(|t| t.window)
    }

    /// Prints text. `level`: one of [`mod@print`].
    pub fn print(self, level: c_int, text: &str) {
        if let Some(printf) = self.get(|t| t.printf) {
            in_c_pieces(text, |piece| {
                // SAFETY: the engine's variadic print with a literal format and one NUL-terminated string.
                unsafe { printf(level, c"%s".as_ptr(), piece) }
            });
        }
    }

    /// Prints to the console and the log.
    pub fn say(self, text: &str) {
        self.print(print::ALL, text);
    }

    /// The engine's error function, which does not return.
    pub fn error_function(self) -> Option<unsafe extern "C" fn(c_int, *const c_char, ...)> {
        self.get(|t| t.error)
    }

    /// The first absent service of those without which nothing can be drawn.
    pub fn missing_service(self) -> Option<&'static str> {
        let present = self.get(|t| {
            [
                ("Error", t.error.is_some()),
                ("Cvar_Get", t.cvar_get.is_some()),
                ("FS_ReadFile", t.fs_read_file.is_some()),
                ("FS_FreeFile", t.fs_free_file.is_some()),
            ]
        });
        let mut absent = present.into_iter().filter(|(_, present)| !present);
        absent.next().map(|(name, _)| name)
    }

    /// Engine time in milliseconds (scaled by `timescale`).
    pub fn milliseconds(self) -> c_int {
        // SAFETY: no arguments.
        self.get(|t| t.milliseconds).map_or(0, |f| unsafe { f() })
    }

    /// Finds or makes a variable; applies its latched value. `None` if the engine has no such service.
    pub fn cvar_get(self, name: &CStr, default: &CStr, flags: c_int) -> Option<Variable> {
        let get = self.get(|t| t.cvar_get)?;
        // SAFETY: both strings are valid during the call; the engine copies them.
        let cvar = unsafe { get(name.as_ptr(), default.as_ptr(), flags) };
        // The engine keeps its variables until the process ends.
        NonNull::new(cvar).map(Variable)
    }

    /// Text of a variable of the engine; empty if there is none.
    pub fn cvar_text(self, name: &CStr) -> String {
        self.cvar_get(name, c"", 0)
            .map_or_else(String::new, |cvar| self.cvar_string(cvar))
    }

    /// Text of a variable that the engine may not have; empty if there is none, or the engine has no service that finds
    /// one without making it.
    pub fn cvar_text_if_any(self, name: &str) -> String {
        let Ok(name) = CString::new(name) else {
            return String::new();
        };
        self.get(|t| t.cvar_variable_string)
            // SAFETY: the name is valid during the call; the result is null or NUL-terminated, and is copied at once.
            .map_or_else(String::new, |f| unsafe { string_from(f(name.as_ptr())) })
    }

    /// Sets a variable, regardless of its flags.
    pub fn cvar_set(self, name: &CStr, value: &str) {
        let Ok(value) = CString::new(value) else {
            return;
        };
        if let Some(f) = self.get(|t| t.cvar_set) {
            // SAFETY: both strings are valid during the call; the engine copies them.
            unsafe { f(name.as_ptr(), value.as_ptr()) }
        }
    }

    /// The address of a member of a variable.
    fn member<T>(self, cvar: Variable, offset: impl FnOnce(VariableLayout) -> usize) -> *mut T {
        let offset = self.get(|t| offset(t.variable));
        cvar.as_ptr().wrapping_byte_add(offset).cast()
    }

    /// The value as an integer, as parsed by the engine.
    pub fn cvar_as_integer(self, cvar: Variable) -> c_int {
        // SAFETY: a member of a variable of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { *self.member(cvar, |layout| layout.integer) }
    }

    /// The value as a number, which may be infinite or NaN.
    pub fn cvar_as_number(self, cvar: Variable) -> f32 {
        // SAFETY: a member of a variable of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { *self.member(cvar, |layout| layout.value) }
    }

    /// The value as text.
    pub fn cvar_string(self, cvar: Variable) -> String {
        // SAFETY: a member of a variable of the engine, which only this thread changes; its text is NUL-terminated and
        // is copied before any change.
        unsafe { string_from(*self.member(cvar, |layout| layout.string)) }
    }

    /// Whether the variable's text is readable, and its integer is that of the text: in a variable of another layout they
    /// are not. The memory is read through the kernel, because it may be anything.
    pub fn cvar_is_consistent(self, cvar: Variable) -> bool {
        const LONGEST: usize = 256;
        let read =
            |address: usize, bytes: &mut [u8]| system::read_memory(address, bytes) == bytes.len();
        let string = self.member::<*const c_char>(cvar, |layout| layout.string);
        let integer = self.member::<c_int>(cvar, |layout| layout.integer);
        let (mut address, mut number) = ([0; size_of::<usize>()], [0; size_of::<c_int>()]);
        if !read(string.addr(), &mut address) || !read(integer.addr(), &mut number) {
            return false;
        }
        let start = usize::from_ne_bytes(address);
        let mut text = Vec::new();
        // by bytes, because the page after the text may be unmapped
        while text.len() < LONGEST {
            let mut byte = [0];
            if !read(start.wrapping_add(text.len()), &mut byte) {
                return false;
            }
            if byte == [0] {
                let number = c_int::from_ne_bytes(number);
                let text = String::from_utf8_lossy(&text);
                return whole_number(&text).is_none_or(|expected| expected == number);
            }
            text.extend(byte);
        }
        false
    }

    /// The value as a path of the file system.
    pub fn cvar_path(self, cvar: Variable) -> PathBuf {
        // SAFETY: as for `cvar_string`.
        unsafe { system::path_from(*self.member(cvar, |layout| layout.string)) }
    }

    /// Whether the value has changed since [`Engine::cvar_seen`].
    pub fn cvar_modified(self, cvar: Variable) -> bool {
        // SAFETY: a member of a variable of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { *self.member::<u8>(cvar, |layout| layout.modified) != 0 }
    }

    /// Marks a change as processed, which is the duty of a variable's owner.
    pub fn cvar_seen(self, cvar: Variable) {
        // SAFETY: a member of a variable of the engine, which only this thread changes. The engine expects a variable's
        // owner to clear it.
        unsafe { *self.member::<u8>(cvar, |layout| layout.modified) = 0 }
    }

    /// Limits a variable to a range from now on.
    pub fn cvar_check_range(self, cvar: Variable, min: f32, max: f32, integral: bool) {
        if let Some(f) = self.get(|t| t.cvar_check_range) {
            // SAFETY: `cvar` is one of the engine's own.
            unsafe { f(cvar.as_ptr(), min, max, integral.into()) }
        }
    }

    /// Sets the help text of a variable.
    pub fn cvar_describe(self, cvar: Variable, text: &CStr) {
        if let Some(f) = self.get(|t| t.cvar_set_description) {
            // SAFETY: `cvar` is one of the engine's own; the engine copies the text.
            unsafe { f(cvar.as_ptr(), text.as_ptr()) }
        }
    }

    /// Integer value of any variable; 0 if there is none.
    pub fn cvar_integer(self, name: &CStr) -> c_int {
        // SAFETY: the name is valid during the call.
        self.get(|t| t.cvar_variable_integer_value)
            .map_or(0, |f| unsafe { f(name.as_ptr()) })
    }

    /// Adds a console command. An existing command of that name keeps its function.
    pub fn add_command(self, name: &CStr, function: unsafe extern "C" fn()) {
        if let Some(f) = self.get(|t| t.cmd_add_command) {
            // SAFETY: the name is copied; the function is one of ours and stays mapped (-z nodelete).
            unsafe { f(name.as_ptr(), Some(function)) }
        }
    }

    /// Removes a console command, if it exists.
    pub fn remove_command(self, name: &CStr) {
        if let Some(f) = self.get(|t| t.cmd_remove_command) {
            // SAFETY: the name is valid during the call.
            unsafe { f(name.as_ptr()) }
        }
    }

    /// The words of the running command; the first is its name.
    pub fn arguments(self) -> Vec<String> {
        // SAFETY: no arguments.
        let count = self.get(|t| t.cmd_argc).map_or(0, |f| unsafe { f() });
        let Some(argv) = self.get(|t| t.cmd_argv) else {
            return Vec::new();
        };
        (0..count)
            .map(|i| {
                // SAFETY: for any index the engine returns a string that is valid until the next command; copied at
                // once.
                unsafe { string_from(argv(i)) }
            })
            .collect()
    }

    /// Appends text to the engine's command buffer.
    pub fn append_command(self, text: &CStr) {
        self.buffer_command(EXEC_APPEND, text);
    }

    /// Inserts text before the commands that the engine's buffer holds.
    pub fn insert_command(self, text: &CStr) {
        self.buffer_command(EXEC_INSERT, text);
    }

    fn buffer_command(self, place: c_int, text: &CStr) {
        if let Some(f) = self.get(|t| t.cmd_execute_text) {
            // SAFETY: the text is copied. Text of the buffer runs later, not from inside this call.
            unsafe { f(place, text.as_ptr()) }
        }
    }

    /// Whether cluster `to` is visible from cluster `from` by the collision model's visibility data; both must be
    /// clusters of the loaded map.
    pub fn cluster_sees(self, from: i32, to: i32) -> bool {
        let (Some(f), Ok(bit)) = (self.get(|t| t.cm_cluster_pvs), usize::try_from(to)) else {
            return false;
        };
        // SAFETY: the engine accepts any cluster. The row that it returns has a bit for each cluster of the map, and
        // `to` is a cluster of the map, by the caller's contract.
        unsafe {
            let row = f(from);
            !row.is_null() && *row.add(bit / 8) & (1 << (bit % 8)) != 0
        }
    }

    /// Reads a whole game file; `None` if it does not exist.
    ///
    /// The name must have passed [`valid_game_path`](super::valid_game_path).
    pub fn read_file(self, name: &CStr) -> Option<Vec<u8>> {
        let read = self.get(|t| t.fs_read_file)?;
        let free = self.get(|t| t.fs_free_file)?;
        let mut buffer: *mut c_void = ptr::null_mut();
        // SAFETY: the name is not empty (an empty one is a fatal error); the engine writes the address of its buffer.
        let length = unsafe { read(name.as_ptr(), &mut buffer) };
        if buffer.is_null() {
            return None;
        }
        let contents = usize::try_from(length).ok().map(|length| {
            // SAFETY: the engine's buffer holds `length` bytes and is valid until it is freed.
            unsafe { std::slice::from_raw_parts(buffer.cast::<u8>(), length) }.to_vec()
        });
        // SAFETY: freed once, before anything else is read: the engine's temporary memory is a stack.
        unsafe { free(buffer) };
        contents
    }

    /// Whether a game file exists, in packs or folders.
    pub fn has_file(self, name: &CStr) -> bool {
        // SAFETY: without a buffer, the engine only tests for the file.
        self.get(|t| t.fs_read_file)
            .is_some_and(|f| unsafe { f(name.as_ptr(), ptr::null_mut()) } >= 0)
    }

    /// Files in a folder, in the engine's order.
    pub fn list_files(self, directory: &CStr, extension: &CStr) -> Vec<String> {
        let (Some(list), Some(free)) = (
            self.get(|t| t.fs_list_files),
            self.get(|t| t.fs_free_file_list),
        ) else {
            return Vec::new();
        };
        let mut count: c_int = 0;
        // SAFETY: both strings are valid during the call; the engine stores the count.
        let names = unsafe { list(directory.as_ptr(), extension.as_ptr(), &mut count) };
        if names.is_null() {
            return Vec::new();
        }
        let copied = (0..usize::try_from(count).unwrap_or(0))
            .map(|i| {
                // SAFETY: the list holds `count` strings.
                unsafe { string_from(*names.add(i)) }
            })
            .collect();
        // SAFETY: freed once.
        unsafe { free(names) };
        copied
    }

    /// Writes a file in the user's game folder. Returns whether the file exists afterwards: the engine refuses some
    /// names without a result.
    pub fn write_file(self, name: &str, contents: &[u8]) -> bool {
        let (Some(name), Some(f), Ok(length)) = (
            valid_path_to_write(name),
            self.get(|t| t.fs_write_file),
            c_int::try_from(contents.len()),
        ) else {
            return false;
        };
        // SAFETY: name and contents are valid during the call.
        unsafe { f(name.as_ptr(), contents.as_ptr().cast(), length) };
        self.home_file_exists(&name)
    }

    /// Whether a file with this path is in the user's game folder; no path with a NUL is.
    pub fn home_has(self, path: &str) -> bool {
        CString::new(path).is_ok_and(|path| self.home_file_exists(&path))
    }

    /// Whether the user's game folder contains this file (packs are not searched).
    pub fn home_file_exists(self, name: &CStr) -> bool {
        // SAFETY: the name is valid during the call.
        self.get(|t| t.fs_file_exists)
            .is_some_and(|f| is_true(unsafe { f(name.as_ptr()) }))
    }

    /// Starts a video for a material. `None` if it cannot be played.
    pub fn play_cinematic(self, name: &CStr) -> Option<c_int> {
        // SAFETY: the name is valid during the call. The size matters only for videos that the engine draws itself.
        let handle = self
            .get(|t| t.cin_play_cinematic)
            .map(|f| unsafe { f(name.as_ptr(), 0, 0, 256, 256, CIN_MATERIAL) })?;
        (handle >= 0).then_some(handle)
    }

    /// Decodes a video up to the present time. The engine calls `UploadCinematic` during the call.
    pub fn run_cinematic(self, handle: c_int) {
        if let (Some(run), Some(upload)) = (
            self.get(|t| t.cin_run_cinematic),
            self.get(|t| t.cin_upload_cinematic),
        ) {
            // SAFETY: the engine accepts any handle from `play_cinematic`, also of a video that has ended.
            unsafe {
                run(handle);
                upload(handle);
            }
        }
    }

    /// Draws the polygons of the engine's collision debugging; the engine calls `polygon` for each during the call.
    pub fn draw_debug_surface(self, polygon: unsafe extern "C" fn(c_int, c_int, *mut c_float)) {
        if let Some(f) = self.get(|t| t.cm_draw_debug_surface) {
            // SAFETY: the function has the type of the engine's callback.
            unsafe { f(Some(polygon)) }
        }
    }

    /// Appends a frame to the video that the engine records.
    ///
    /// # Safety
    /// `length` bytes must be readable at `data`.
    pub unsafe fn write_avi_frame(self, data: *const c_uchar, length: c_int) {
        if let Some(f) = self.get(|t| t.cl_write_avi_video_frame) {
            // SAFETY: `data` has `length` readable bytes by this function's contract; the engine copies them to its
            // file.
            unsafe { f(data, length) }
        }
    }

    /// Passes the window to the engine's input code.
    ///
    /// # Safety
    /// `window` must be an `SDL_Window` of the process's SDL, valid until [`Engine::input_shutdown`].
    pub unsafe fn input_init(self, window: *mut c_void) {
        if let Some(f) = self.get(|t| t.in_init) {
            // SAFETY: `window` is an SDL window that stays open until `input_shutdown` by this function's contract.
            unsafe { f(window) }
        }
    }

    /// Ends the use of the window by the engine's input code.
    pub fn input_shutdown(self) {
        if let Some(f) = self.get(|t| t.in_shutdown) {
            // SAFETY: no arguments.
            unsafe { f() }
        }
    }

    /// Restarts the input code on the same window.
    pub fn input_restart(self) {
        if let Some(f) = self.get(|t| t.in_restart) {
            // SAFETY: no arguments.
            unsafe { f() }
        }
    }

    /// Notifies the engine that video will start. No effect in present engines.
    pub fn video_init_hook(self, safe: bool) {
        if let Some(f) = self.get(|t| {
            if safe {
                t.sys_glimp_safe_init
            } else {
                t.sys_glimp_init
            }
        }) {
            // SAFETY: no arguments.
            unsafe { f() }
        }
    }

    /// Frees the memory that the renderer got from the engine.
    pub fn free_all(self) {
        if let Some(f) = self.get(|t| t.free_all) {
            // SAFETY: no arguments; the renderer keeps no memory of the engine.
            unsafe { f() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_cut_between_characters_and_keeps_every_byte() {
        let text = "aé".repeat(4000);
        let mut joined = Vec::new();
        let mut pieces = 0;
        in_c_pieces(&text, |piece| {
            // SAFETY: `in_c_pieces` passes NUL-terminated text.
            let piece = unsafe { CStr::from_ptr(piece) };
            assert!(piece.to_bytes().len() < 4000);
            assert!(std::str::from_utf8(piece.to_bytes()).is_ok());
            joined.extend_from_slice(piece.to_bytes());
            pieces += 1;
        });
        assert_eq!(joined, text.as_bytes());
        assert!(pieces > 3);
    }

    #[test]
    fn a_zero_byte_does_not_end_the_text() {
        let mut seen = String::new();
        // SAFETY: NUL-terminated by `in_c_pieces`.
        in_c_pieces("a\0b", |piece| seen = unsafe { string_from(piece) });
        assert_eq!(seen, "a?b");
    }
}
