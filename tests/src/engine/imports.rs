//! The services that the stand-in offers to the renderer, over one state for each thread.
//!
//! No service keeps the state borrowed while it calls the renderer, since the renderer calls back.

use std::cell::RefCell;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};
use std::ffi::{CStr, CString, c_char, c_int, c_long, c_uchar, c_uint, c_void};
use std::ptr;
use std::rc::Rc;
use std::time::Instant;

use super::abi::{ERR_FATAL, cvar_t, glconfig_t, openarena, quake3e, refexport_t, refimport_t};
use super::cvars::Cvars;
use super::files::Files;
use super::memory::Memory;

// What shim.c offers.
unsafe extern "C" {
    pub(super) fn stand_in_call(
        thunk: unsafe extern "C" fn(*mut c_void),
        argument: *mut c_void,
    ) -> c_int;
    fn stand_in_printf(level: c_int, format: *const c_char, ...);
    fn stand_in_raise(level: c_int, format: *const c_char, ...);
    // The C library's.
    fn srand(seed: c_uint);
}

/// Starts the C library's random numbers anew.
pub(super) fn seed_random_numbers() {
    // SAFETY: sets a number of the C library's.
    unsafe { srand(1) };
}

/// A message of the renderer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// 0 for all, 1 for developers, 2 a warning, 3 an error.
    pub level: i32,
    /// The text, with its line end.
    pub text: String,
}

/// Whose services the renderer is offered, all under one version number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tables {
    /// 40 services.
    #[default]
    Ioquake3,
    /// The same with four more at the end.
    WorldOfPadman,
    /// 39: without `Cvar_SetDescription`, and variables without a description.
    OpenArena,
    /// 56, most of them elsewhere, some for a window that the engine makes.
    Quake3e,
    /// The same with numbers in place of the last services.
    Quake3eCutOff,
}

impl Tables {
    /// The variable `version`.
    pub(super) fn version(self) -> &'static str {
        match self {
            Tables::Ioquake3 => "ioq3 1.36",
            Tables::WorldOfPadman => "wop 1.36",
            Tables::OpenArena => "OpenArena 0.8.8 oa2020",
            Tables::Quake3e | Tables::Quake3eCutOff => "Q3 1.32e",
        }
    }

    /// What `Shutdown` gets when the window is to be closed.
    pub(super) fn close_code(self) -> c_int {
        match self {
            Tables::Quake3e | Tables::Quake3eCutOff => 2,
            _ => 1,
        }
    }
}

/// A picture of a film.
#[derive(Clone)]
pub(super) struct Film {
    /// Pixels.
    pub side: c_int,
    pub rgba: Rc<[u8]>,
}

impl Default for Film {
    /// Magenta, a colour that nothing else in the small game has.
    fn default() -> Self {
        Self {
            side: 64,
            rgba: [255u8, 0, 255, 255].repeat(64 * 64).into(),
        }
    }
}

/// State of the engine side.
pub(super) struct State {
    pub tables: Tables,
    pub exports: Option<refexport_t>,
    /// The functions that only this engine's renderers have.
    pub quake3e: Option<quake3e::refexport_t>,
    /// Where `BeginRegistration` writes; the real engine keeps one such structure for good.
    pub config: Box<glconfig_t>,
    pub cvars: Cvars,
    pub commands: HashMap<String, unsafe extern "C" fn()>,
    pub arguments: Vec<CString>,
    pub buffer: VecDeque<String>,
    pub files: Files,
    pub memory: Memory,
    pub lists: Vec<(Vec<CString>, Vec<*mut c_char>)>,
    pub messages: Vec<Message>,
    /// Errors that the renderer raised, the level first.
    pub raised: Option<(i32, String)>,
    /// An error is being handled: another one ends a real process.
    pub handling: bool,
    /// `BeginRegistration` has returned since the last `Shutdown`.
    pub registered: bool,
    pub started: Instant,
    /// Milliseconds, where the test holds the clock.
    pub clock: Option<c_int>,
    /// The collision model's visibility: clusters, bytes of a row, rows.
    pub visibility: Option<(usize, usize, Vec<u8>)>,
    pub everything_visible: Vec<u8>,
    /// Frames handed to the video writer.
    pub video: Vec<Vec<u8>>,
    /// Names of the films that play, by handle.
    pub films: Vec<String>,
    /// What each of them shows.
    pub film: Film,
    pub windows: Vec<usize>,
    /// What happened to the window that the engine makes, and to what depends on it.
    pub window_events: Vec<String>,
}

thread_local! {
    static STATE: RefCell<Option<State>> = const { RefCell::new(None) };
}

/// Installs the state of a new engine and returns the old one.
pub(super) fn install(state: Option<State>) -> Option<State> {
    STATE.with(|cell| cell.replace(state))
}

/// Works on the state. Never call the renderer from `f`.
pub(super) fn with<R>(f: impl FnOnce(&mut State) -> R) -> Option<R> {
    STATE.with(|cell| cell.try_borrow_mut().ok()?.as_mut().map(f))
}

/// The C string as text, empty for NULL.
pub(super) fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the renderer passes NUL-terminated strings that live for the call.
    unsafe { CStr::from_ptr(pointer) }
        .to_string_lossy()
        .into_owned()
}

/// A size that the renderer asks for; negative ones are its mistake.
fn size(bytes: c_int) -> usize {
    usize::try_from(bytes).unwrap_or_else(|_| {
        violation(format!("{bytes} bytes of memory were asked for"));
        0
    })
}

/// Writes down what the renderer must not do.
pub(super) fn violation(what: String) {
    with(|s| s.memory.violations.push(what));
}

/// Called by shim.c.
#[unsafe(no_mangle)]
extern "C" fn stand_in_print(level: c_int, message: *const c_char) {
    let text = text(message);
    if testkit::is_set("RELIGHT_VERBOSE") {
        eprint!("[{level}] {text}");
    }
    with(|s| s.messages.push(Message { level, text }));
}

/// Called by shim.c before it jumps: what the engine does inside `Error`, while the frames that raised the error are
/// still there. A dropped game is shut down and its menu registered anew; a fatal error shuts everything down.
#[unsafe(no_mangle)]
extern "C" fn stand_in_error(level: c_int, message: *const c_char) {
    let message = text(message);
    let Some((exports, registered, handling, close)) = with(|s| {
        let before = (s.exports, s.registered, s.handling, s.tables.close_code());
        s.raised = Some((level, message.clone()));
        if s.handling {
            s.memory.violations.push(format!(
                "an error inside the handling of an error: {message}"
            ));
        }
        s.handling = true;
        s.registered = false;
        before
    }) else {
        return;
    };
    if handling || !registered {
        with(|s| s.handling = handling);
        return;
    }
    if let Some(exports) = exports {
        if level == ERR_FATAL {
            // SAFETY: the library is loaded, and this is its thread.
            let _ = super::call(move || unsafe { (exports.Shutdown)(close) });
        } else {
            // SAFETY: as above.
            let _ = super::call(move || unsafe { (exports.Shutdown)(0) });
            let _ = super::begin_registration(exports);
        }
    }
    with(|s| {
        s.handling = false;
        s.raised = Some((level, message));
    });
}

extern "C" fn milliseconds() -> c_int {
    with(|s| {
        s.clock
            .unwrap_or_else(|| s.started.elapsed().as_millis() as c_int)
    })
    .unwrap_or(0)
}

pub(super) extern "C" fn hunk_alloc(bytes: c_int, _preference: c_int) -> *mut c_void {
    let bytes = size(bytes);
    with(|s| s.memory.hunk(bytes)).unwrap_or(ptr::null_mut())
}

pub(super) extern "C" fn hunk_allocate_temporary(bytes: c_int) -> *mut c_void {
    let bytes = size(bytes);
    with(|s| s.memory.push_temporary(bytes)).unwrap_or(ptr::null_mut())
}

extern "C" fn hunk_free_temporary(block: *mut c_void) {
    with(|s| s.memory.pop_temporary(block));
}

pub(super) extern "C" fn zone_malloc(bytes: c_int) -> *mut c_void {
    let bytes = size(bytes);
    with(|s| s.memory.zone(bytes)).unwrap_or(ptr::null_mut())
}

extern "C" fn zone_free(block: *mut c_void) {
    with(|s| s.memory.free_zone(block));
}

extern "C" fn cvar_get(name: *const c_char, value: *const c_char, flags: c_int) -> *mut c_void {
    let (name, value) = (text(name), text(value));
    with(|s| s.cvars.get(&name, &value, flags))
        .unwrap_or(ptr::null_mut())
        .cast()
}

extern "C" fn cvar_set(name: *const c_char, value: *const c_char) {
    let (name, value) = (text(name), text(value));
    with(|s| s.cvars.force(&name, &value));
}

extern "C" fn cvar_set_value(name: *const c_char, value: f32) {
    let name = text(name);
    with(|s| s.cvars.force(&name, &value.to_string()));
}

pub(super) extern "C" fn cvar_check_range(cvar: *mut c_void, min: f32, max: f32, integral: c_int) {
    let cvar = cvar.cast::<cvar_t>();
    if min > max || with(|s| s.cvars.check_range(cvar, min, max, integral != 0)) == Some(false) {
        violation(format!("Cvar_CheckRange({cvar:?}, {min}, {max})"));
    }
}

extern "C" fn cvar_set_description(cvar: *mut c_void, description: *const c_char) {
    let cvar = cvar.cast::<cvar_t>();
    let description = text(description);
    if with(|s| s.cvars.set_description(cvar, &description)) == Some(false) {
        violation(format!("Cvar_SetDescription({cvar:?}, {description:?})"));
    }
}

extern "C" fn cvar_variable_integer_value(name: *const c_char) -> c_int {
    let name = text(name);
    with(|s| s.cvars.integer(&name)).unwrap_or(0)
}

extern "C" fn cmd_add_command(name: *const c_char, command: Option<unsafe extern "C" fn()>) {
    let name = text(name).to_ascii_lowercase();
    let Some(command) = command else { return };
    let added = with(|s| match s.commands.entry(name.clone()) {
        Entry::Vacant(place) => {
            place.insert(command);
            true
        }
        // The engine keeps the old pointer, which dangles once a library is gone.
        Entry::Occupied(_) => false,
    });
    if added == Some(false) {
        violation(format!("the command {name} was added while it existed"));
    }
}

extern "C" fn cmd_remove_command(name: *const c_char) {
    let name = text(name).to_ascii_lowercase();
    with(|s| s.commands.remove(&name));
}

extern "C" fn cmd_argc() -> c_int {
    with(|s| s.arguments.len() as c_int).unwrap_or(0)
}

extern "C" fn cmd_argv(i: c_int) -> *mut c_char {
    static EMPTY: &CStr = c"";
    let argument = with(|s| {
        let i = usize::try_from(i).ok()?;
        Some(s.arguments.get(i)?.as_ptr().cast_mut())
    });
    argument.flatten().unwrap_or(EMPTY.as_ptr().cast_mut())
}

extern "C" fn cmd_execute_text(when: c_int, command: *const c_char) {
    let command = text(command);
    match when {
        0 => {
            let found = super::prepare(&command);
            drop(command);
            if let Some(found) = found {
                // SAFETY: a command of the renderer, whose library is loaded.
                unsafe { found() };
            }
        }
        1 => _ = with(|s| s.buffer.push_front(command)),
        _ => _ = with(|s| s.buffer.push_back(command)),
    }
}

extern "C" fn cm_cluster_pvs(cluster: c_int) -> *mut c_uchar {
    with(|s| {
        let row = s.visibility.as_mut().and_then(|(clusters, bytes, rows)| {
            let cluster = usize::try_from(cluster).ok().filter(|c| c < clusters)?;
            rows.get_mut(cluster * *bytes..(cluster + 1) * *bytes)
        });
        row.map_or_else(|| s.everything_visible.as_mut_ptr(), <[u8]>::as_mut_ptr)
    })
    .unwrap_or(ptr::null_mut())
}

/// Collision code that wants to see a red square 50 units before [`crate::maps::HERE`], facing it.
extern "C" fn cm_draw_debug_surface(draw: Option<unsafe extern "C" fn(c_int, c_int, *mut f32)>) {
    let corner = |side: f32, up: f32| {
        let place = crate::maps::HERE + glam::Vec3::new(50.0, side, up);
        place.to_array()
    };
    let mut corners = [
        corner(10.0, 10.0),
        corner(-10.0, 10.0),
        corner(-10.0, -10.0),
        corner(10.0, -10.0),
    ];
    if let Some(draw) = draw {
        // SAFETY: four corners.
        unsafe { draw(1, 4, corners.as_mut_ptr().cast()) };
    }
}

extern "C" fn fs_file_is_in_pak(name: *const c_char, checksum: *mut c_int) -> c_int {
    let name = text(name);
    let found = with(|s| s.files.in_pack(&name)).unwrap_or(false);
    if found && !checksum.is_null() {
        // SAFETY: the renderer passes NULL or a place for the checksum.
        unsafe { *checksum = 1 };
    }
    if found { 1 } else { -1 }
}

pub(super) extern "C" fn fs_read_file(name: *const c_char, buffer: *mut *mut c_void) -> c_long {
    let name = text(name);
    if name.is_empty() || name.len() >= 64 {
        // An empty name ends a real process; a long one is cut.
        violation(format!("FS_ReadFile({name:?})"));
        return -1;
    }
    let Some(bytes) = with(|s| s.files.read(&name)).flatten() else {
        if !buffer.is_null() {
            // SAFETY: a place for the pointer.
            unsafe { *buffer = ptr::null_mut() };
        }
        return -1;
    };
    if !buffer.is_null() {
        let Some(start) = with(|s| s.memory.push_temporary(bytes.len() + 1)) else {
            return -1;
        };
        // SAFETY: `start` has room for the bytes and a zero, which is there already; `buffer` is a place for it.
        unsafe {
            ptr::copy_nonoverlapping(bytes.as_ptr(), start.cast(), bytes.len());
            *buffer = start;
        }
    }
    bytes.len() as c_long
}

extern "C" fn fs_free_file(buffer: *mut c_void) {
    with(|s| s.memory.pop_temporary(buffer));
}

extern "C" fn fs_list_files(
    dir: *const c_char,
    extension: *const c_char,
    count: *mut c_int,
) -> *mut *mut c_char {
    let (dir, extension) = (text(dir), text(extension));
    let names: Vec<CString> = with(|s| s.files.list(&dir, &extension))
        .unwrap_or_default()
        .into_iter()
        .filter_map(|n| CString::new(n).ok())
        .collect();
    if !count.is_null() {
        // SAFETY: a place for the count.
        unsafe { *count = names.len() as c_int };
    }
    let mut pointers: Vec<*mut c_char> = names.iter().map(|n| n.as_ptr().cast_mut()).collect();
    pointers.push(ptr::null_mut());
    let start = pointers.as_mut_ptr();
    with(|s| s.lists.push((names, pointers)));
    start
}

extern "C" fn fs_free_file_list(list: *mut *mut c_char) {
    let found = with(|s| {
        let before = s.lists.len();
        s.lists
            .retain(|(_, pointers)| !ptr::eq(pointers.as_ptr(), list));
        before != s.lists.len()
    });
    if found == Some(false) && !list.is_null() {
        violation("FS_FreeFileList of something that is no list".into());
    }
}

extern "C" fn fs_write_file(name: *const c_char, bytes: *const c_void, length: c_int) {
    let name = text(name);
    let length = size(length);
    if bytes.is_null() {
        return;
    }
    // SAFETY: the renderer passes `length` readable bytes.
    let bytes = unsafe { std::slice::from_raw_parts(bytes.cast::<u8>(), length) };
    if name.contains("..") || name.contains("::") {
        // The real one refuses in a line that players overlook.
        return violation(format!("FS_WriteFile({name:?})"));
    }
    if let Some(Err(error)) = with(|s| s.files.write(&name, bytes)) {
        let text = format!("Failed to open {name}: {error}\n");
        with(|s| s.messages.push(Message { level: 0, text }));
    }
}

extern "C" fn fs_file_exists(name: *const c_char) -> c_int {
    let name = text(name);
    with(|s| s.files.exists_at_home(&name))
        .unwrap_or(false)
        .into()
}

extern "C" fn cin_upload(handle: c_int) {
    let Some((Some(exports), true, film)) = with(|s| {
        let known = usize::try_from(handle).is_ok_and(|h| h < s.films.len());
        (s.exports, known, s.film.clone())
    }) else {
        return;
    };
    let side = film.side;
    // SAFETY: the library is loaded; the picture has the passed size and is valid during the call.
    unsafe { (exports.UploadCinematic)(side, side, side, side, film.rgba.as_ptr(), handle, 1) };
}

extern "C" fn cin_play(
    name: *const c_char,
    _x: c_int,
    _y: c_int,
    _w: c_int,
    _h: c_int,
    _bits: c_int,
) -> c_int {
    let name = text(name);
    with(|s| {
        let file = if name.contains('/') {
            name.clone()
        } else {
            format!("video/{name}")
        };
        s.files.read(&file)?;
        let playing = s.films.iter().position(|f| *f == name);
        let handle = playing.unwrap_or_else(|| {
            s.films.push(name);
            s.films.len() - 1
        });
        c_int::try_from(handle).ok()
    })
    .flatten()
    .unwrap_or(-1)
}

extern "C" fn cin_run(_handle: c_int) -> c_int {
    1 // it plays
}

extern "C" fn write_video_frame(bytes: *const c_uchar, length: c_int) {
    let length = size(length);
    if bytes.is_null() {
        return violation("CL_WriteAVIVideoFrame(NULL)".into());
    }
    // SAFETY: the renderer passes `length` readable bytes.
    let frame = unsafe { std::slice::from_raw_parts(bytes, length) }.to_vec();
    with(|s| s.video.push(frame));
}

extern "C" fn input_init(window: *mut c_void) {
    with(|s| s.windows.push(window.addr()));
}

extern "C" fn nothing() {}

extern "C" fn ftol(value: f32) -> c_long {
    value as c_long
}

extern "C" fn set_environment(_name: *const c_char, _value: *const c_char) {}

extern "C" fn low_physical_memory() -> c_int {
    0
}

/// A service that a renderer of this table must not call: ends the process.
extern "C" fn wrong_service() {
    panic!("a service of an unknown table was called");
}

/// The words of a table.
fn words_of<T, const N: usize>(table: T) -> [usize; 64] {
    const { assert!(size_of::<T>() == N * size_of::<usize>() && N <= 64) };
    let mut words = [0; 64];
    // SAFETY: a structure of optional function pointers alone, as large as `N` words.
    unsafe { ptr::copy_nonoverlapping((&raw const table).cast(), words.as_mut_ptr(), N) };
    words
}

/// The words of the table that `GetRefAPI` gets, with zeros behind them.
pub(super) fn words(tables: Tables) -> [usize; 64] {
    let wrong = (wrong_service as *const ()).expose_provenance();
    match tables {
        Tables::Ioquake3 => words_of::<_, 40>(ioquake3_table()),
        Tables::WorldOfPadman => {
            let mut words = words_of::<_, 40>(ioquake3_table());
            words[40..44].fill(wrong);
            words
        }
        Tables::OpenArena => words_of::<_, 39>(openarena_table()),
        Tables::Quake3e => words_of::<_, 56>(quake3e_table()),
        Tables::Quake3eCutOff => {
            let mut words = words_of::<_, 56>(quake3e_table());
            words[50..56].fill(1);
            words
        }
    }
}

/// A table with the services that the engines have in common, and others.
macro_rules! table {
    ($table:ident { $($field:ident: $function:expr),* $(,)? }) => {
        $table {
            $($field: Some($function),)*
            Printf: Some(stand_in_printf),
            Error: Some(stand_in_raise),
            Milliseconds: Some(milliseconds),
            Hunk_FreeTempMemory: Some(hunk_free_temporary),
            Free: Some(zone_free),
            Cvar_Get: Some(cvar_get),
            Cvar_Set: Some(cvar_set),
            Cvar_SetValue: Some(cvar_set_value),
            Cvar_VariableIntegerValue: Some(cvar_variable_integer_value),
            Cmd_AddCommand: Some(cmd_add_command),
            Cmd_RemoveCommand: Some(cmd_remove_command),
            Cmd_Argc: Some(cmd_argc),
            Cmd_Argv: Some(cmd_argv),
            Cmd_ExecuteText: Some(cmd_execute_text),
            CM_ClusterPVS: Some(cm_cluster_pvs),
            CM_DrawDebugSurface: Some(cm_draw_debug_surface),
            FS_FreeFile: Some(fs_free_file),
            FS_ListFiles: Some(fs_list_files),
            FS_FreeFileList: Some(fs_free_file_list),
            FS_WriteFile: Some(fs_write_file),
            FS_FileExists: Some(fs_file_exists),
            CIN_UploadCinematic: Some(cin_upload),
            CIN_PlayCinematic: Some(cin_play),
            CIN_RunCinematic: Some(cin_run),
            CL_WriteAVIVideoFrame: Some(write_video_frame),
            Sys_LowPhysicalMemory: Some(low_physical_memory),
        }
    };
}

/// [`table`] with what engines have whose renderer makes the window.
macro_rules! renderer_made_window {
    ($table:ident { $($field:ident: $function:expr),* $(,)? }) => {
        table!($table {
            $($field: $function,)*
            Hunk_Alloc: hunk_alloc,
            Hunk_AllocateTempMemory: hunk_allocate_temporary,
            Malloc: zone_malloc,
            Cvar_CheckRange: cvar_check_range,
            FS_FileIsInPAK: fs_file_is_in_pak,
            FS_ReadFile: fs_read_file,
            IN_Init: input_init,
            IN_Shutdown: nothing,
            IN_Restart: nothing,
            ftol: ftol,
            Sys_SetEnv: set_environment,
            Sys_GLimpSafeInit: nothing,
            Sys_GLimpInit: nothing,
        })
    };
}

fn ioquake3_table() -> refimport_t {
    renderer_made_window!(refimport_t {
        Cvar_SetDescription: cvar_set_description
    })
}

fn openarena_table() -> openarena::refimport_t {
    use openarena::refimport_t;
    renderer_made_window!(refimport_t {})
}

fn quake3e_table() -> quake3e::refimport_t {
    use super::quake3e as own;
    use quake3e::refimport_t;
    table!(refimport_t {
        Microseconds: own::microseconds,
        Hunk_Alloc: own::hunk_alloc,
        Hunk_AllocateTempMemory: own::hunk_allocate_temporary,
        Malloc: own::zone_malloc,
        FreeAll: own::free_all,
        Cvar_CheckRange: own::cvar_check_range,
        Cvar_SetDescription: cvar_set_description,
        Cvar_SetGroup: own::cvar_set_group,
        Cvar_CheckGroup: own::cvar_check_group,
        Cvar_ResetGroup: own::cvar_reset_group,
        Cvar_VariableStringBuffer: own::cvar_variable_string_buffer,
        Cvar_VariableString: own::cvar_variable_string,
        FS_ReadFile: own::fs_read_file,
        CL_SaveJPGToBuffer: own::save_jpeg_to_buffer,
        CL_SaveJPG: own::save_jpeg,
        CL_LoadJPG: own::load_jpeg,
        CL_IsMinimized: own::is_minimized,
        CL_SetScaling: own::set_scaling,
        Sys_SetClipboardBitmap: own::set_clipboard,
        Com_RealTime: own::real_time,
        GLimp_InitGamma: own::opengl_config,
        GLimp_SetGamma: own::set_gamma,
        GLimp_Init: own::opengl_config,
        GLimp_Shutdown: own::opengl_shutdown,
        GLimp_EndFrame: own::opengl_end_frame,
        GL_GetProcAddress: own::opengl_function,
        VKimp_Init: own::open_window,
        VKimp_Shutdown: own::close_window,
        VK_GetInstanceProcAddr: own::instance_function,
        VK_CreateSurface: own::create_surface,
    })
}
