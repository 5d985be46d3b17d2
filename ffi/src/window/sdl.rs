//! SDL 2, loaded at run time: the same library that the engine uses.
//!
//! Hand-written declarations of SDL's stable 2.0 ABI (`SDL_video.h`, `SDL_vulkan.h`).

use libloading::Library;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;

/// `SDL_INIT_VIDEO`.
const INIT_VIDEO: u32 = 0x20;

/// `SDL_WindowFlags`.
#[allow(missing_docs)]
pub mod flags {
    pub const FULLSCREEN: u32 = 0x1;
    pub const SHOWN: u32 = 0x4;
    pub const HIDDEN: u32 = 0x8;
    pub const BORDERLESS: u32 = 0x10;
    pub const RESIZABLE: u32 = 0x20;
    pub const MINIMIZED: u32 = 0x40;
    pub const VULKAN: u32 = 0x1000_0000;
}

/// `SDL_WINDOWPOS_UNDEFINED`.
pub const POSITION_ANY: c_int = 0x1FFF_0000;
/// `SDL_WINDOWPOS_CENTERED`.
pub const POSITION_CENTERED: c_int = 0x2FFF_0000;

/// An `SDL_Window`.
pub type WindowPtr = *mut c_void;

/// An `SDL_EventFilter`: its data, an `SDL_Event`; 0 drops the event.
pub type Filter = unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_int;

/// `SDL_DisplayMode`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DisplayMode {
    /// `SDL_PixelFormatEnum`; 0 = any.
    pub format: u32,
    /// Pixels (or points, see SDL).
    pub w: c_int,
    /// Pixels.
    pub h: c_int,
    /// Hz; 0 = any.
    pub refresh_rate: c_int,
    /// SDL's own.
    pub driverdata: *mut c_void,
}

impl Default for DisplayMode {
    fn default() -> Self {
        Self {
            format: 0,
            w: 0,
            h: 0,
            refresh_rate: 0,
            driverdata: ptr::null_mut(),
        }
    }
}

/// Reason why SDL cannot make a window.
#[derive(Debug, thiserror::Error)]
pub enum SdlError {
    /// Neither the engine nor the system has SDL.
    #[error("no SDL 2 to make a window with: {0}")]
    NoLibrary(String),
    /// SDL is too old.
    #[error("SDL lacks {0}: version 2.0.6 or newer is needed")]
    NoFunction(String),
    /// A call failed.
    #[error("{call}: {message}")]
    Call {
        /// SDL's name of the function.
        call: &'static str,
        /// An error of SDL.
        message: String,
    },
}

macro_rules! sdl {
    ($( $field:ident = $symbol:literal : fn($($arg:ty),*) $(-> $ret:ty)?; )*) => {
        /// SDL's functions. Copied out of a library that is never closed.
        #[derive(Clone, Copy)]
        pub struct Sdl { $( $field: unsafe extern "C" fn($($arg),*) $(-> $ret)? ),* }

        impl Sdl {
            fn from_library(library: &Library) -> Result<Self, SdlError> {
                Ok(Self { $(
                    // SAFETY: the signature is the one of SDL's header.
                    $field: *unsafe { library.get::<unsafe extern "C" fn($($arg),*) $(-> $ret)?>(concat!($symbol, "\0").as_bytes()) }
                        .map_err(|_| SdlError::NoFunction($symbol.to_string()))?,
                )* })
            }
        }
    };
}

sdl! {
    init_subsystem = "SDL_InitSubSystem": fn(u32) -> c_int;
    was_init = "SDL_WasInit": fn(u32) -> u32;
    quit_subsystem = "SDL_QuitSubSystem": fn(u32);
    get_error = "SDL_GetError": fn() -> *const c_char;
    video_driver = "SDL_GetCurrentVideoDriver": fn() -> *const c_char;
    create_window = "SDL_CreateWindow": fn(*const c_char, c_int, c_int, c_int, c_int, u32) -> WindowPtr;
    destroy_window = "SDL_DestroyWindow": fn(WindowPtr);
    minimize_window = "SDL_MinimizeWindow": fn(WindowPtr);
    window_flags = "SDL_GetWindowFlags": fn(WindowPtr) -> u32;
    set_fullscreen = "SDL_SetWindowFullscreen": fn(WindowPtr, u32) -> c_int;
    set_window_mode = "SDL_SetWindowDisplayMode": fn(WindowPtr, *const DisplayMode) -> c_int;
    window_mode = "SDL_GetWindowDisplayMode": fn(WindowPtr, *mut DisplayMode) -> c_int;
    display_index = "SDL_GetWindowDisplayIndex": fn(WindowPtr) -> c_int;
    desktop_mode = "SDL_GetDesktopDisplayMode": fn(c_int, *mut DisplayMode) -> c_int;
    num_display_modes = "SDL_GetNumDisplayModes": fn(c_int) -> c_int;
    display_mode = "SDL_GetDisplayMode": fn(c_int, c_int, *mut DisplayMode) -> c_int;
    pump_events = "SDL_PumpEvents": fn();
    set_event_filter = "SDL_SetEventFilter": fn(Option<Filter>, *mut c_void);
    get_event_filter = "SDL_GetEventFilter": fn(*mut Option<Filter>, *mut *mut c_void) -> c_int;
    relative_mouse = "SDL_GetRelativeMouseMode": fn() -> c_int;
    vulkan_extensions = "SDL_Vulkan_GetInstanceExtensions": fn(WindowPtr, *mut u32, *mut *const c_char) -> c_int;
    vulkan_loader = "SDL_Vulkan_GetVkGetInstanceProcAddr": fn() -> *mut c_void;
    vulkan_surface = "SDL_Vulkan_CreateSurface": fn(WindowPtr, *mut c_void, *mut u64) -> c_int;
    vulkan_drawable_size = "SDL_Vulkan_GetDrawableSize": fn(WindowPtr, *mut c_int, *mut c_int);
}

impl std::fmt::Debug for Sdl {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Sdl")
    }
}

#[cfg(windows)]
const SDL_NAME: &str = "SDL2.dll";
#[cfg(target_os = "macos")]
const SDL_NAME: &str = "libSDL2-2.0.0.dylib";
#[cfg(all(unix, not(target_os = "macos")))]
const SDL_NAME: &str = "libSDL2-2.0.so.0";

/// The SDL that is already loaded, as a shared library or inside of the executable.
fn already_loaded() -> Option<Library> {
    #[cfg(unix)]
    {
        use libloading::os::unix::{Library as UnixLibrary, RTLD_LAZY};
        // glibc's value; other systems of this family have the same or ignore it.
        #[cfg(target_os = "linux")]
        const RTLD_NOLOAD: c_int = 4;
        #[cfg(not(target_os = "linux"))]
        const RTLD_NOLOAD: c_int = 0x10;
        // SAFETY: with NOLOAD no code of the library runs.
        if let Ok(library) = unsafe { UnixLibrary::open(Some(SDL_NAME), RTLD_LAZY | RTLD_NOLOAD) } {
            return Some(library.into());
        }
        let own: Library = UnixLibrary::this().into();
        // SAFETY: only tests whether the symbol exists.
        unsafe { own.get::<*const c_void>(b"SDL_CreateWindow\0") }
            .is_ok()
            .then_some(own)
    }
    #[cfg(windows)]
    {
        use libloading::os::windows::Library as WindowsLibrary;
        // ioquake3 named its 64-bit copy SDL264.dll until July 2025.
        let names = [SDL_NAME, "SDL264.dll"].into_iter();
        let mut found = names.filter_map(|name| WindowsLibrary::open_already_loaded(name).ok());
        found.next().map(Into::into)
    }
}

/// The loaded SDL, otherwise the system's.
fn open() -> Result<Library, SdlError> {
    if let Some(library) = already_loaded() {
        return Ok(library);
    }
    #[cfg(unix)]
    {
        use libloading::os::unix::{Library as UnixLibrary, RTLD_NOW};
        // SAFETY: SDL's initialisers are safe at load time.
        unsafe { UnixLibrary::open(Some(SDL_NAME), RTLD_NOW) }
            .map(Into::into)
            .map_err(|e| SdlError::NoLibrary(e.to_string()))
    }
    #[cfg(windows)]
    {
        // SAFETY: SDL's initialisers are safe at load time.
        unsafe { Library::new(SDL_NAME) }.map_err(|e| SdlError::NoLibrary(e.to_string()))
    }
}

impl Sdl {
    /// Finds SDL. The library stays loaded, because the engine uses it.
    ///
    /// # Errors
    /// SDL is absent, or too old for Vulkan.
    pub fn load() -> Result<Sdl, SdlError> {
        let library = open()?;
        let sdl = Sdl::from_library(&library);
        std::mem::forget(library);
        sdl
    }

    /// The SDL that the engine has loaded; `None` without one. It stays loaded.
    pub fn loaded() -> Option<Sdl> {
        let library = already_loaded()?;
        let sdl = Sdl::from_library(&library).ok();
        std::mem::forget(library);
        sdl
    }

    /// Whether SDL's video runs.
    pub fn runs_video(&self) -> bool {
        // SAFETY: SDL allows any set of subsystems, at any time.
        unsafe { (self.was_init)(INIT_VIDEO) != 0 }
    }

    /// Whether the pointer is invisible and only its motion counts.
    pub fn is_pointer_relative(&self) -> bool {
        // SAFETY: no arguments.
        unsafe { (self.relative_mouse)() != 0 }
    }

    /// The filter of events and its data.
    pub fn event_filter(&self) -> Option<(Filter, *mut c_void)> {
        let mut filter = None;
        let mut data = ptr::null_mut();
        // SAFETY: SDL fills both pointers; without a filter it stores null and returns 0.
        let set = unsafe { (self.get_event_filter)(&mut filter, &mut data) };
        filter.filter(|_| set != 0).map(|filter| (filter, data))
    }

    /// Sets the filter of events. SDL also empties its queue of events.
    ///
    /// # Safety
    /// `filter` must be callable with `data` on any thread until another filter is set.
    pub unsafe fn set_event_filter(&self, filter: Option<Filter>, data: *mut c_void) {
        // SAFETY: the caller's contract is that of SDL.
        unsafe { (self.set_event_filter)(filter, data) }
    }

    fn error(&self, call: &'static str) -> SdlError {
        // SAFETY: SDL allows this call at any time.
        let text = unsafe { (self.get_error)() };
        // SAFETY: SDL's own NUL-terminated buffer, which its next error changes; copied at once.
        let message = unsafe { crate::engine::string_from(text) };
        SdlError::Call { call, message }
    }

    /// Starts SDL's video unless it runs. Returns the driver's name.
    ///
    /// # Errors
    /// No display can be reached.
    pub fn start_video(&self) -> Result<String, SdlError> {
        // SAFETY: SDL allows any set of subsystems, at any time.
        let runs = unsafe { (self.was_init)(INIT_VIDEO) } != 0;
        // SAFETY: on the engine's main thread, which also makes the engine's own calls of SDL.
        if !runs && unsafe { (self.init_subsystem)(INIT_VIDEO) } != 0 {
            return Err(self.error("SDL_Init"));
        }
        // SAFETY: SDL allows this call at any time.
        let driver = unsafe { (self.video_driver)() };
        // SAFETY: null, or SDL's own static NUL-terminated name; copied at once.
        Ok(unsafe { crate::engine::string_from(driver) })
    }

    /// Ends SDL's video. All windows must be closed.
    pub fn stop_video(&self) {
        // SAFETY: on the engine's main thread; SDL counts the users of its video, and ends it after the last one.
        unsafe { (self.quit_subsystem)(INIT_VIDEO) }
    }

    /// Size of a display's desktop, if SDL can determine it.
    pub fn desktop(&self, display: c_int) -> Option<DisplayMode> {
        let mut mode = DisplayMode::default();
        // SAFETY: SDL accepts any index and fills the structure for a valid one.
        (unsafe { (self.desktop_mode)(display, &mut mode) } == 0).then_some(mode)
    }

    /// Full-screen sizes of a display.
    pub fn display_sizes(&self, display: c_int) -> Vec<(u32, u32)> {
        // SAFETY: SDL accepts any index; an invalid one gives a negative count.
        let count = unsafe { (self.num_display_modes)(display) };
        (0..count)
            .filter_map(|index| {
                let mut mode = DisplayMode::default();
                // SAFETY: `index` is below SDL's count of modes; SDL fills the structure.
                let known = unsafe { (self.display_mode)(display, index, &mut mode) } == 0;
                known.then_some((u32::try_from(mode.w).ok()?, u32::try_from(mode.h).ok()?))
            })
            .collect()
    }

    /// Makes a window for Vulkan.
    ///
    /// # Errors
    /// An error of SDL, for example if the video driver does not support Vulkan.
    pub fn create(
        &self,
        title: &CStr,
        position: c_int,
        width: u32,
        height: u32,
        flags: u32,
    ) -> Result<WindowPtr, SdlError> {
        let (Ok(width), Ok(height)) = (c_int::try_from(width), c_int::try_from(height)) else {
            return Err(SdlError::Call {
                call: "SDL_CreateWindow",
                message: format!("{width}x{height} is too large"),
            });
        };
        // SAFETY: the title is copied.
        let window = unsafe {
            (self.create_window)(
                title.as_ptr(),
                position,
                position,
                width,
                height,
                flags | flags::VULKAN,
            )
        };
        if window.is_null() {
            Err(self.error("SDL_CreateWindow"))
        } else {
            Ok(window)
        }
    }

    /// Destroys a window.
    ///
    /// # Safety
    /// `window` must be a window of this SDL that is not used again.
    pub unsafe fn destroy(&self, window: WindowPtr) {
        // SAFETY: `window` is an open window of this SDL by this function's contract, and is not used afterwards.
        unsafe { (self.destroy_window)(window) }
    }

    /// Minimizes a window.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn minimize(&self, window: WindowPtr) {
        // SAFETY: `window` is an open window of this SDL by this function's contract.
        unsafe { (self.minimize_window)(window) }
    }

    /// Whether a window is in full screen.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn is_fullscreen(&self, window: WindowPtr) -> bool {
        // SAFETY: `window` is an open window of this SDL by this function's contract; its flags are a number.
        unsafe { (self.window_flags)(window) & flags::FULLSCREEN != 0 }
    }

    /// Whether a window is invisible.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn is_hidden(&self, window: WindowPtr) -> bool {
        // SAFETY: `window` is an open window of this SDL by this function's contract; its flags are a number.
        unsafe { (self.window_flags)(window) & (flags::HIDDEN | flags::MINIMIZED) != 0 }
    }

    /// Switches a window to full screen or back.
    ///
    /// # Errors
    /// An error of SDL.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn switch_fullscreen(&self, window: WindowPtr, on: bool) -> Result<(), SdlError> {
        let flags = if on { flags::FULLSCREEN } else { 0 };
        // SAFETY: `window` is an open window of this SDL by this function's contract.
        if unsafe { (self.set_fullscreen)(window, flags) } != 0 {
            return Err(self.error("SDL_SetWindowFullscreen"));
        }
        // SAFETY: no arguments; video runs, because there is a window. The new size is known after the window system's
        // reply.
        unsafe { (self.pump_events)() };
        Ok(())
    }

    /// Sets the size and refresh rate of a window in full screen.
    ///
    /// # Errors
    /// An error of SDL.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn set_mode(
        &self,
        window: WindowPtr,
        width: u32,
        height: u32,
        refresh: c_int,
    ) -> Result<(), SdlError> {
        let mode = DisplayMode {
            w: c_int::try_from(width).unwrap_or(0),
            h: c_int::try_from(height).unwrap_or(0),
            refresh_rate: refresh,
            ..DisplayMode::default()
        };
        // SAFETY: `window` is an open window of this SDL by this function's contract; SDL copies the structure.
        if unsafe { (self.set_window_mode)(window, &mode) } == 0 {
            Ok(())
        } else {
            Err(self.error("SDL_SetWindowDisplayMode"))
        }
    }

    /// Refresh rate of a window's display, Hz; 0 if unknown.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn refresh_rate(&self, window: WindowPtr) -> c_int {
        let mut mode = DisplayMode::default();
        // SAFETY: `window` is an open window of this SDL by this function's contract; SDL fills the structure.
        if unsafe { (self.window_mode)(window, &mut mode) } == 0 {
            mode.refresh_rate
        } else {
            0
        }
    }

    /// The display of a window; the first one if unknown.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn display_of(&self, window: WindowPtr) -> c_int {
        // SAFETY: `window` is an open window of this SDL by this function's contract.
        unsafe { (self.display_index)(window) }.max(0)
    }

    /// Size of a window's Vulkan surface, pixels; `None` if it has none.
    ///
    /// # Safety
    /// `window` must be a window of this SDL.
    pub unsafe fn drawable_size(&self, window: WindowPtr) -> Option<(u32, u32)> {
        let (mut width, mut height) = (0, 0);
        // SAFETY: `window` is an open window made for Vulkan by this function's contract; SDL fills both numbers.
        unsafe { (self.vulkan_drawable_size)(window, &mut width, &mut height) };
        let size = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
        (size.0 > 0 && size.1 > 0).then_some(size)
    }

    /// Instance extensions that a surface for this window needs.
    ///
    /// # Errors
    /// An error of SDL.
    ///
    /// # Safety
    /// `window` must be a window of this SDL, made for Vulkan.
    pub unsafe fn instance_extensions(&self, window: WindowPtr) -> Result<Vec<CString>, SdlError> {
        let mut count = 0;
        // SAFETY: `window` is an open window made for Vulkan by this function's contract; without a list SDL only
        // counts.
        if unsafe { (self.vulkan_extensions)(window, &mut count, ptr::null_mut()) } == 0 {
            return Err(self.error("SDL_Vulkan_GetInstanceExtensions"));
        }
        let mut names = vec![ptr::null(); usize::try_from(count).unwrap_or(0)];
        // SAFETY: the list has room for `count` names.
        if unsafe { (self.vulkan_extensions)(window, &mut count, names.as_mut_ptr()) } == 0 {
            return Err(self.error("SDL_Vulkan_GetInstanceExtensions"));
        }
        names.truncate(usize::try_from(count).unwrap_or(0));
        // SAFETY: SDL's names are static NUL-terminated strings.
        Ok(names
            .into_iter()
            .filter(|name| !name.is_null())
            .map(|name| unsafe { CStr::from_ptr(name) }.to_owned())
            .collect())
    }

    /// `vkGetInstanceProcAddr` of SDL's Vulkan loader.
    ///
    /// # Errors
    /// SDL has no Vulkan support.
    pub fn vulkan_entry(&self) -> Result<*const c_void, SdlError> {
        // SAFETY: no arguments; SDL returns null if it has loaded no Vulkan.
        let entry = unsafe { (self.vulkan_loader)() };
        if entry.is_null() {
            Err(self.error("SDL_Vulkan_GetVkGetInstanceProcAddr"))
        } else {
            Ok(entry)
        }
    }

    /// Makes a `VkSurfaceKHR` for a window.
    ///
    /// # Errors
    /// An error of SDL.
    ///
    /// # Safety
    /// `window` must be a window of this SDL made for Vulkan, `instance` a live `VkInstance` with the extensions of
    /// [`Sdl::instance_extensions`].
    pub unsafe fn create_surface(&self, window: WindowPtr, instance: u64) -> Result<u64, SdlError> {
        let mut surface = 0;
        let instance = ptr::with_exposed_provenance_mut(usize::try_from(instance).unwrap_or(0));
        // SAFETY: window and instance are live and match by this function's contract. A VkSurfaceKHR has 64 bits
        // everywhere.
        if unsafe { (self.vulkan_surface)(window, instance, &mut surface) } == 0 {
            return Err(self.error("SDL_Vulkan_CreateSurface"));
        }
        Ok(surface)
    }
}
