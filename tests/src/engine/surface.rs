//! The window of an engine that makes it without SDL, and its Vulkan surface: a window of Windows; elsewhere a surface
//! without a display, for which there is no window.

use std::ffi::{CStr, c_int, c_void};
use std::ptr;

use super::quake3e::instance_function;

/// `vkCreate…Surface…` and its extension.
#[cfg(not(windows))]
pub const EXTENSION: &CStr = c"VK_EXT_headless_surface";
#[cfg(not(windows))]
const CREATE: &CStr = c"vkCreateHeadlessSurfaceEXT";
#[cfg(windows)]
pub const EXTENSION: &CStr = c"VK_KHR_win32_surface";
#[cfg(windows)]
const CREATE: &CStr = c"vkCreateWin32SurfaceKHR";

/// `VkHeadlessSurfaceCreateInfoEXT` or `VkWin32SurfaceCreateInfoKHR`.
#[repr(C)]
struct Info {
    kind: c_int,
    next: *const c_void,
    flags: u32,
    #[cfg(windows)]
    program: *mut c_void,
    #[cfg(windows)]
    window: *mut c_void,
}

#[cfg(not(windows))]
fn info() -> Info {
    Info {
        kind: 1_000_256_000,
        next: ptr::null(),
        flags: 0,
    }
}

#[cfg(windows)]
fn info() -> Info {
    Info {
        kind: 1_000_009_000,
        next: ptr::null(),
        flags: 0,
        program: ptr::null_mut(),
        window: window::current(),
    }
}

/// Opens a window of this size.
pub fn open(_width: c_int, _height: c_int) {
    #[cfg(windows)]
    window::open(_width, _height);
}

/// Closes it.
pub fn close() {
    #[cfg(windows)]
    window::close();
}

/// Makes the surface of the window. Returns whether it did.
pub fn create(instance: *mut c_void, surface: *mut u64) -> bool {
    type Create =
        unsafe extern "system" fn(*mut c_void, *const Info, *const c_void, *mut u64) -> c_int;
    let function = instance_function(instance, CREATE.as_ptr());
    if function.is_null() {
        return false;
    }
    // SAFETY: the function of that name has this type.
    let create = unsafe { std::mem::transmute::<*mut c_void, Create>(function) };
    // SAFETY: the renderer's instance, and a place for the surface.
    unsafe { create(instance, &info(), ptr::null(), surface) == 0 }
}

#[cfg(windows)]
#[allow(non_snake_case)] // Windows' names
mod window {
    use std::cell::Cell;
    use std::ffi::{CStr, c_char, c_int, c_void};
    use std::ptr;

    #[link(name = "user32")]
    unsafe extern "system" {
        fn CreateWindowExA(
            extended_style: u32,
            class: *const c_char,
            title: *const c_char,
            style: u32,
            x: c_int,
            y: c_int,
            width: c_int,
            height: c_int,
            parent: *mut c_void,
            menu: *mut c_void,
            program: *mut c_void,
            parameter: *mut c_void,
        ) -> *mut c_void;
        fn DestroyWindow(window: *mut c_void) -> c_int;
    }

    thread_local! {
        static OPEN: Cell<*mut c_void> = const { Cell::new(ptr::null_mut()) };
    }

    pub fn current() -> *mut c_void {
        OPEN.get()
    }

    pub fn open(width: c_int, height: c_int) {
        const CLASS: &CStr = c"STATIC";
        /// `WS_POPUP | WS_VISIBLE`: all of the window is drawn to.
        const STYLE: u32 = 0x9000_0000;
        close();
        let none = ptr::null_mut();
        // SAFETY: a class of the system, and texts that are copied.
        let window = unsafe {
            let (class, title) = (CLASS.as_ptr(), c"".as_ptr());
            CreateWindowExA(
                0, class, title, STYLE, 0, 0, width, height, none, none, none, none,
            )
        };
        OPEN.set(window);
    }

    pub fn close() {
        let window = OPEN.replace(ptr::null_mut());
        if !window.is_null() {
            // SAFETY: a window of this thread.
            unsafe { DestroyWindow(window) };
        }
    }
}
