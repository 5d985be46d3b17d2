//! The services that the stand-in offers to the renderer, over one state for each thread.
//!
//! No service keeps the state borrowed while it calls the renderer, since the renderer calls back.

mod tables;

use std::cell::RefCell;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};
use std::ffi::{CStr, CString, c_char, c_int, c_long, c_uchar, c_uint, c_void};
use std::ptr;
use std::rc::Rc;
use std::time::Instant;

use super::abi::{ERR_DROP, ERR_FATAL, cvar_t, glconfig_t, quake3e, refexport_t, tremulous};
use super::cvars::Cvars;
use super::files::Files;
use super::memory::Memory;
pub use tables::Tables;
pub(super) use tables::words;

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
    pub tremulous: Option<tremulous::refexport_t>,
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
    /// A file in a damaged pack: reading it ends in an error of the engine.
    pub damaged: Option<String>,
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
    if with(|s| s.damaged.as_ref() == Some(&name)) == Some(true) {
        drop(name);
        // SAFETY: a format without arguments; this frame owns nothing.
        unsafe { stand_in_raise(ERR_DROP, c"damaged pack".as_ptr()) };
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
