//! The services that Quake3e alone offers, or with other types.

use std::ffi::{CStr, c_char, c_int, c_long, c_uchar, c_void};
use std::ptr;
use std::sync::OnceLock;

use libloading::Library;

use super::abi::glconfig_t;
use super::imports::{self, text, violation, with};
use super::surface;

type GetInstanceProcAddr = unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void;

/// File of the system's Vulkan loader.
const LOADER_FILE: &str = if cfg!(windows) {
    "vulkan-1.dll"
} else {
    "libvulkan.so.1"
};

/// `vkGetInstanceProcAddr` of the system's loader, which stays in memory.
fn loader() -> Option<GetInstanceProcAddr> {
    static LOADER: OnceLock<Option<GetInstanceProcAddr>> = OnceLock::new();
    *LOADER.get_or_init(|| {
        // SAFETY: the Vulkan loader, whose initializers are safe at load time.
        let library = unsafe { Library::new(LOADER_FILE) }.ok()?;
        // SAFETY: the loader's function has this type.
        let function =
            *unsafe { library.get::<GetInstanceProcAddr>(b"vkGetInstanceProcAddr\0") }.ok()?;
        std::mem::forget(library);
        Some(function)
    })
}

fn event(what: impl Into<String>) {
    with(|s| s.window_events.push(what.into()));
}

pub(super) extern "C" fn microseconds() -> i64 {
    with(|s| s.started.elapsed().as_micros() as i64).unwrap_or(0)
}

fn int(bytes: usize) -> c_int {
    c_int::try_from(bytes).unwrap_or(-1)
}

pub(super) extern "C" fn hunk_alloc(bytes: usize, preference: c_int) -> *mut c_void {
    imports::hunk_alloc(int(bytes), preference)
}

pub(super) extern "C" fn hunk_allocate_temporary(bytes: usize) -> *mut c_void {
    imports::hunk_allocate_temporary(int(bytes))
}

pub(super) extern "C" fn zone_malloc(bytes: usize) -> *mut c_void {
    imports::zone_malloc(int(bytes))
}

pub(super) extern "C" fn free_all() {
    event("FreeAll");
}

/// Limits are texts; null is no limit.
pub(super) extern "C" fn cvar_check_range(
    cvar: *mut c_void,
    min: *const c_char,
    max: *const c_char,
    kind: c_int,
) {
    let limit = |limit: *const c_char, none: f32| {
        if limit.is_null() {
            return none;
        }
        let limit = text(limit);
        limit.parse().unwrap_or_else(|_| {
            violation(format!("Cvar_CheckRange with {limit:?}"));
            none
        })
    };
    if !(1..=2).contains(&kind) {
        violation(format!("Cvar_CheckRange of kind {kind}"));
    }
    let (min, max) = (limit(min, f32::MIN), limit(max, f32::MAX));
    imports::cvar_check_range(cvar, min, max, (kind == 2).into());
}

pub(super) extern "C" fn cvar_set_group(_cvar: *mut c_void, _group: c_int) {}

pub(super) extern "C" fn cvar_check_group(_group: c_int) -> c_int {
    1
}

pub(super) extern "C" fn cvar_reset_group(_group: c_int, _modified: c_int) {}

pub(super) extern "C" fn cvar_variable_string_buffer(_: *const c_char, _: *mut c_char, _: c_int) {
    violation("Cvar_VariableStringBuffer is not needed".into());
}

pub(super) extern "C" fn cvar_variable_string(name: *const c_char) -> *const c_char {
    let name = text(name);
    with(|s| s.cvars.place_of_text(&name)).unwrap_or(ptr::null())
}

pub(super) extern "C" fn fs_read_file(name: *const c_char, buffer: *mut *mut c_void) -> c_int {
    let length: c_long = imports::fs_read_file(name, buffer);
    c_int::try_from(length).unwrap_or(-1)
}

pub(super) extern "C" fn save_jpeg_to_buffer(
    _: *mut c_uchar,
    _: usize,
    _: c_int,
    _: c_int,
    _: c_int,
    _: *mut c_uchar,
    _: c_int,
) -> usize {
    0
}

pub(super) extern "C" fn save_jpeg(
    _: *const c_char,
    _: c_int,
    _: c_int,
    _: c_int,
    _: *mut c_uchar,
    _: c_int,
) {
}

pub(super) extern "C" fn load_jpeg(
    _: *const c_char,
    _: *mut *mut c_uchar,
    _: *mut c_int,
    _: *mut c_int,
) {
}

pub(super) extern "C" fn is_minimized() -> c_int {
    0
}

pub(super) extern "C" fn set_scaling(factor: f32, width: c_int, height: c_int) {
    event(format!("scale {factor} {width}x{height}"));
}

pub(super) extern "C" fn set_clipboard(_bitmap: *const c_uchar, _size: c_int) {}

pub(super) extern "C" fn real_time(_time: *mut c_void) -> c_int {
    0
}

pub(super) extern "C" fn opengl_config(_config: *mut glconfig_t) {
    violation("OpenGL was asked for".into());
}

pub(super) extern "C" fn set_gamma(_: *mut c_uchar, _: *mut c_uchar, _: *mut c_uchar) {}

pub(super) extern "C" fn opengl_shutdown(_unload: c_int) {
    violation("OpenGL was shut down".into());
}

pub(super) extern "C" fn opengl_end_frame() {
    violation("a frame of OpenGL was ended".into());
}

pub(super) extern "C" fn opengl_function(_name: *const c_char) -> *mut c_void {
    ptr::null_mut()
}

/// A window of 320x240.
pub(super) extern "C" fn open_window(config: *mut glconfig_t) {
    event("open");
    surface::open(320, 240);
    // SAFETY: the renderer passes a structure, which is its own for as long as the window is open.
    let config = unsafe { &mut *config };
    (config.vidWidth, config.vidHeight) = (320, 240);
    config.windowAspect = 320.0 / 240.0;
    config.displayFrequency = 60;
    config.isFullscreen = 0;
}

pub(super) extern "C" fn close_window(unload: c_int) {
    event(format!("close {unload}"));
    surface::close();
}

pub(super) extern "C" fn instance_function(
    instance: *mut c_void,
    name: *const c_char,
) -> *mut c_void {
    // SAFETY: the arguments are those of the loader's function.
    loader().map_or(ptr::null_mut(), |get| unsafe { get(instance, name) })
}

/// Whether the Vulkan loader offers the extension for surfaces of this engine's window.
pub fn has_surfaces() -> bool {
    /// `VkExtensionProperties`.
    #[repr(C)]
    #[derive(Clone, Copy)]
    struct Extension {
        name: [c_char; 256],
        _version: u32,
    }
    type Enumerate = unsafe extern "C" fn(*const c_char, *mut u32, *mut Extension) -> c_int;
    let name = c"vkEnumerateInstanceExtensionProperties".as_ptr();
    let function = instance_function(ptr::null_mut(), name);
    if function.is_null() {
        return false;
    }
    // SAFETY: the function of that name has this type.
    let enumerate = unsafe { std::mem::transmute::<*mut c_void, Enumerate>(function) };
    let mut found = [Extension {
        name: [0; 256],
        _version: 0,
    }; 256];
    let mut count = found.len() as u32;
    // SAFETY: room for `count` structures, whose number the loader returns. Negative results are errors.
    let failed = unsafe { enumerate(ptr::null(), &mut count, found.as_mut_ptr()) } < 0;
    let mut found = found.iter().take(count as usize).filter(|_| !failed);
    // SAFETY: names are NUL-terminated.
    found.any(|e| unsafe { CStr::from_ptr(e.name.as_ptr()) } == surface::EXTENSION)
}

/// A surface of the window.
pub(super) extern "C" fn create_surface(instance: *mut c_void, surface: *mut u64) -> c_int {
    event("surface");
    surface::create(instance, surface).into()
}
