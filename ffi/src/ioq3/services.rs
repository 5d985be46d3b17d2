//! The services of ioquake3's table; raw pointers and C strings stay inside of this module.
//!
//! Every service may leave by `longjmp` on an error of the engine. The calls here have no destructor on the stack that
//! correctness depends on; only memory can leak in this case.

use super::abi::{self, QBool, cvar_t, refimport_t};
use crate::engine::{self, Services, Variable, string_from, valid_path_to_write};
use std::cell::UnsafeCell;
use std::ffi::{CStr, CString, c_char, c_float, c_int, c_uchar, c_void};
use std::ptr;

/// Storage for `GetRefAPI`'s copy of the engine's table.
struct Imports(UnsafeCell<Option<refimport_t>>);

// SAFETY: only `GetRefAPI` writes it and calls of the engine read it, all on the engine's main thread
// (`session::on_main_thread` refuses all other threads earlier).
unsafe impl Sync for Imports {}

static IMPORTS: Imports = Imports(UnsafeCell::new(None));

/// An engine with ioquake3's table. A token: the table itself is a static, replaced by each `GetRefAPI`.
#[derive(Clone, Copy, Debug)]
pub struct Ioq3(());

static IOQ3: Ioq3 = Ioq3(());

/// A variable in ioquake3's layout.
fn raw(cvar: Variable) -> *mut cvar_t {
    cvar.as_ptr().cast()
}

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

impl Ioq3 {
    /// Stores the engine's table and installs its services.
    ///
    /// # Safety
    /// Every function of the table must be callable with the signature of the engine's ABI until the process ends, and
    /// this must run on the engine's main thread while no other call of ours runs.
    pub unsafe fn install(table: refimport_t) -> &'static Ioq3 {
        // SAFETY: no other call of ours runs, and this is the main thread, by this function's contract: no other code
        // accesses the table.
        unsafe { *IMPORTS.0.get() = Some(table) };
        engine::install(&IOQ3);
        &IOQ3
    }

    /// One function of the table.
    fn get<F>(self, pick: impl FnOnce(&refimport_t) -> Option<F>) -> Option<F> {
        // SAFETY: main thread only; the reference ends with this expression.
        unsafe { (*IMPORTS.0.get()).as_ref().and_then(pick) }
    }

    /// Sets a variable's description and tests whether the engine stores it, as engines with ioquake3's tables do. In
    /// the other engines of its family, the same entry of the table only searches a variable of that name, and the
    /// member is another pointer into the engine's memory.
    pub fn cvar_keeps_description(self, cvar: Variable, text: &CStr) -> bool {
        self.cvar_describe(cvar, text);
        // SAFETY: the engine's own variable; in the other engines of the family, too, it has a member at this offset.
        let kept = unsafe { (*raw(cvar)).description }.cast::<u8>();
        let mut bytes = text.to_bytes_with_nul().iter().enumerate();
        // SAFETY: bytes are read up to the first difference: in a copy of the text, its zero is the last byte read; in
        // other engines the pointer is to a variable, which is larger than the matching part.
        !kept.is_null() && bytes.all(|(i, &byte)| unsafe { *kept.add(i) } == byte)
    }
}

impl Services for Ioq3 {
    fn print(&self, level: c_int, text: &str) {
        if let Some(printf) = self.get(|t| t.Printf) {
            in_c_pieces(text, |piece| {
                // SAFETY: the engine's variadic print with a literal format and one NUL-terminated string.
                unsafe { printf(level, c"%s".as_ptr(), piece) }
            });
        }
    }

    fn error_function(&self) -> Option<unsafe extern "C" fn(c_int, *const c_char, ...)> {
        self.get(|t| t.Error)
    }

    fn milliseconds(&self) -> c_int {
        // SAFETY: no arguments.
        self.get(|t| t.Milliseconds).map_or(0, |f| unsafe { f() })
    }

    fn cvar_get(&self, name: &CStr, default: &CStr, flags: c_int) -> Option<Variable> {
        let get = self.get(|t| t.Cvar_Get)?;
        // SAFETY: both strings live through the call; the engine copies them.
        let cvar = unsafe { get(name.as_ptr(), default.as_ptr(), flags) };
        // SAFETY: null, or a `cvar_t` of the engine, which keeps its cvars until the process ends.
        unsafe { Variable::new(cvar.cast()) }
    }

    fn cvar_set(&self, name: &CStr, value: &str) {
        let Ok(value) = CString::new(value) else {
            debug_assert!(false, "{value:?} contains a NUL");
            return;
        };
        if let Some(f) = self.get(|t| t.Cvar_Set) {
            // SAFETY: both strings live through the call; the engine copies them.
            unsafe { f(name.as_ptr(), value.as_ptr()) }
        }
    }

    fn cvar_as_integer(&self, cvar: Variable) -> c_int {
        // SAFETY: a `cvar_t` of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { (*raw(cvar)).integer }
    }

    fn cvar_as_number(&self, cvar: Variable) -> f32 {
        // SAFETY: a `cvar_t` of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { (*raw(cvar)).value }
    }

    fn cvar_string(&self, cvar: Variable) -> String {
        // SAFETY: a `cvar_t` of the engine, which only this thread changes; its text is NUL-terminated and is copied
        // before any change.
        unsafe { string_from((*raw(cvar)).string) }
    }

    fn cvar_modified(&self, cvar: Variable) -> bool {
        // SAFETY: a `cvar_t` of the engine, which only this thread changes: there are no concurrent writes.
        unsafe { (*raw(cvar)).modified != 0 }
    }

    fn cvar_seen(&self, cvar: Variable) {
        const NO: QBool = 0;
        // SAFETY: a `cvar_t` of the engine, which only this thread changes. The engine expects a variable's owner to
        // clear this member.
        unsafe { (*raw(cvar)).modified = NO }
    }

    fn cvar_check_range(&self, cvar: Variable, min: f32, max: f32, integral: bool) {
        if let Some(f) = self.get(|t| t.Cvar_CheckRange) {
            // SAFETY: `cvar` is one of the engine's own.
            unsafe { f(raw(cvar), min, max, integral.into()) }
        }
    }

    fn cvar_describe(&self, cvar: Variable, text: &CStr) {
        if let Some(f) = self.get(|t| t.Cvar_SetDescription) {
            // SAFETY: `cvar` is one of the engine's own; the engine copies the text.
            unsafe { f(raw(cvar), text.as_ptr()) }
        }
    }

    fn cvar_integer(&self, name: &CStr) -> c_int {
        // SAFETY: the name is valid during the call.
        self.get(|t| t.Cvar_VariableIntegerValue)
            .map_or(0, |f| unsafe { f(name.as_ptr()) })
    }

    fn add_command(&self, name: &CStr, function: unsafe extern "C" fn()) {
        if let Some(f) = self.get(|t| t.Cmd_AddCommand) {
            // SAFETY: the name is copied; the function is one of ours and stays mapped (-z nodelete).
            unsafe { f(name.as_ptr(), Some(function)) }
        }
    }

    fn remove_command(&self, name: &CStr) {
        if let Some(f) = self.get(|t| t.Cmd_RemoveCommand) {
            // SAFETY: the name is valid during the call.
            unsafe { f(name.as_ptr()) }
        }
    }

    fn arguments(&self) -> Vec<String> {
        // SAFETY: no arguments.
        let count = self.get(|t| t.Cmd_Argc).map_or(0, |f| unsafe { f() });
        let Some(argv) = self.get(|t| t.Cmd_Argv) else {
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

    fn append_command(&self, text: &CStr) {
        if let Some(f) = self.get(|t| t.Cmd_ExecuteText) {
            // SAFETY: the text is copied. Appended text runs later, not from inside this call.
            unsafe { f(abi::EXEC_APPEND, text.as_ptr()) }
        }
    }

    fn cluster_sees(&self, from: i32, to: i32) -> bool {
        let (Some(f), Ok(bit)) = (self.get(|t| t.CM_ClusterPVS), usize::try_from(to)) else {
            return false;
        };
        // SAFETY: the engine accepts any cluster. The row that it returns has a bit for each cluster of the map, and
        // `to` is a cluster of the map, by the caller's contract.
        unsafe {
            let row = f(from);
            !row.is_null() && *row.add(bit / 8) & (1 << (bit % 8)) != 0
        }
    }

    fn read_file(&self, name: &CStr) -> Option<Vec<u8>> {
        let read = self.get(|t| t.FS_ReadFile)?;
        let free = self.get(|t| t.FS_FreeFile)?;
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

    fn has_file(&self, name: &CStr) -> bool {
        // SAFETY: without a buffer, the engine only tests for the file.
        self.get(|t| t.FS_ReadFile)
            .is_some_and(|f| unsafe { f(name.as_ptr(), ptr::null_mut()) } >= 0)
    }

    fn list_files(&self, directory: &CStr, extension: &CStr) -> Vec<String> {
        let (Some(list), Some(free)) = (
            self.get(|t| t.FS_ListFiles),
            self.get(|t| t.FS_FreeFileList),
        ) else {
            return Vec::new();
        };
        let mut count: c_int = 0;
        // SAFETY: both strings live through the call; the engine stores the count.
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

    fn write_file(&self, name: &str, contents: &[u8]) -> bool {
        let (Some(name), Some(f), Ok(length)) = (
            valid_path_to_write(name),
            self.get(|t| t.FS_WriteFile),
            c_int::try_from(contents.len()),
        ) else {
            return false;
        };
        // SAFETY: name and contents live through the call.
        unsafe { f(name.as_ptr(), contents.as_ptr().cast(), length) };
        self.home_file_exists(&name)
    }

    fn home_file_exists(&self, name: &CStr) -> bool {
        // SAFETY: the name is valid during the call.
        self.get(|t| t.FS_FileExists)
            .is_some_and(|f| unsafe { f(name.as_ptr()) } != 0)
    }

    fn play_cinematic(&self, name: &CStr) -> Option<c_int> {
        // SAFETY: the name is valid during the call. The size matters only for videos that the engine draws itself.
        let handle = self
            .get(|t| t.CIN_PlayCinematic)
            .map(|f| unsafe { f(name.as_ptr(), 0, 0, 256, 256, abi::CIN_MATERIAL) })?;
        (handle >= 0).then_some(handle)
    }

    fn run_cinematic(&self, handle: c_int) {
        if let (Some(run), Some(upload)) = (
            self.get(|t| t.CIN_RunCinematic),
            self.get(|t| t.CIN_UploadCinematic),
        ) {
            // SAFETY: the engine accepts any handle from `play_cinematic`, also of a video that has ended.
            unsafe {
                run(handle);
                upload(handle);
            }
        }
    }

    fn draw_debug_surface(&self, polygon: unsafe extern "C" fn(c_int, c_int, *mut c_float)) {
        if let Some(f) = self.get(|t| t.CM_DrawDebugSurface) {
            // SAFETY: the function has the type of the engine's callback.
            unsafe { f(Some(polygon)) }
        }
    }

    unsafe fn write_avi_frame(&self, data: *const c_uchar, length: c_int) {
        if let Some(f) = self.get(|t| t.CL_WriteAVIVideoFrame) {
            // SAFETY: `data` has `length` readable bytes by this function's contract; the engine copies them to its
            // file.
            unsafe { f(data, length) }
        }
    }

    unsafe fn input_init(&self, window: *mut c_void) {
        if let Some(f) = self.get(|t| t.IN_Init) {
            // SAFETY: `window` is an SDL window that stays open until `input_shutdown` by this function's contract.
            unsafe { f(window) }
        }
    }

    fn input_shutdown(&self) {
        if let Some(f) = self.get(|t| t.IN_Shutdown) {
            // SAFETY: no arguments.
            unsafe { f() }
        }
    }

    fn input_restart(&self) {
        if let Some(f) = self.get(|t| t.IN_Restart) {
            // SAFETY: no arguments.
            unsafe { f() }
        }
    }

    fn video_init_hook(&self, safe: bool) {
        if let Some(f) = self.get(|t| {
            if safe {
                t.Sys_GLimpSafeInit
            } else {
                t.Sys_GLimpInit
            }
        }) {
            // SAFETY: no arguments.
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
