//! The window. In most engines of the family the renderer makes it, with the engine's SDL, and passes it to the engine's
//! input code; some engines make it themselves ([`WindowServices`]).
//!
//! It is stored in its own cell, separate from the renderer, because it must be accessible after an error of the engine
//! has abandoned a call of the renderer (see `session`).

pub mod input;
pub mod modes;
pub mod sdl;

use crate::cvars::{Cvar, Cvars};
use crate::engine::{Engine, WindowServices};
use modes::{Custom, Mode};
use sdl::{Sdl, SdlError, WindowPtr};
use std::cell::Cell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;

/// Whose window it is.
#[derive(Clone, Copy, Debug)]
enum Owner {
    /// Ours.
    Renderer {
        sdl: Sdl,
        raw: WindowPtr,
        /// The engine's input code uses it.
        given: bool,
    },
    /// The engine's, as it described it.
    Engine {
        services: WindowServices,
        fullscreen: bool,
        refresh_rate: c_int,
    },
}

/// An open window.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    owner: Owner,
    /// Drawable size at the last registration, pixels.
    pub size: (u32, u32),
    /// Width over height of the display.
    pub aspect: f32,
    /// A leaked renderer may still present to it: the next registration must replace the window.
    pub stale: bool,
}

/// Why a window is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closing {
    /// Another one is opened at once.
    ForAnother,
    /// Video ends.
    Video,
    /// Video ends for good.
    Leave,
}

struct OpenWindow(Cell<Option<Window>>);

// SAFETY: only exports access it, through `boundary::entry`, which refuses all threads but the engine's main one.
unsafe impl Sync for OpenWindow {}

static OPEN: OpenWindow = OpenWindow(Cell::new(None));

/// The open window, if there is one.
pub fn current() -> Option<Window> {
    OPEN.0.get()
}

fn update(change: impl FnOnce(&mut Window)) {
    if let Some(mut window) = OPEN.0.get() {
        change(&mut window);
        OPEN.0.set(Some(window));
    }
}

/// Updates the stored size of the open window, for a new renderer.
pub fn refresh_size() {
    if let Some(size) = current().and_then(|window| window.drawable_size()) {
        update(|window| {
            if window.size != size {
                window.size = size;
                window.aspect = size.0 as f32 / size.1 as f32;
            }
        });
    }
}

/// Marks the open window as used by a leaked renderer.
pub fn mark_stale() {
    update(|window| window.stale = true);
}

/// Reason why no window was opened.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// The safe mode failed, too.
    #[error(
        "no window could be opened for Vulkan ({0}); check that a display is connected and that its driver supports Vulkan"
    )]
    Sdl(#[from] SdlError),
    /// The engine's window has no size.
    #[error("the engine opened no window")]
    Engine,
}

/// Video settings of one attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wish {
    mode: i32,
    fullscreen: bool,
    borderless: bool,
}

/// Attempts in order: the requested mode, the same in a window, the safe mode in a window.
fn attempts(wish: Wish) -> Vec<Wish> {
    let mut list = vec![wish];
    for next in [
        Wish {
            borderless: false,
            ..wish
        },
        Wish {
            mode: modes::SAFE_MODE,
            fullscreen: false,
            borderless: false,
        },
    ] {
        if list.last() != Some(&next) {
            list.push(next);
        }
    }
    list
}

/// Resets settings that may have caused a crash, if the engine reports that the last run crashed and the player agreed.
pub fn apply_safe_settings(engine: Engine) {
    if engine.cvar_integer(c"com_abnormalExit") == 0 {
        return;
    }
    for (name, value) in [
        (c"r_mode", "3"),
        (c"r_fullscreen", "0"),
        (c"r_centerWindow", "0"),
        (c"com_abnormalExit", "0"),
    ] {
        engine.cvar_set(name, value);
    }
}

fn custom(cvars: &Cvars) -> Custom {
    Custom {
        width: cvars.integer(Cvar::CustomWidth),
        height: cvars.integer(Cvar::CustomHeight),
        pixel_aspect: cvars.value(Cvar::CustomPixelAspect),
    }
}

/// The size for rendering without a window.
pub fn headless_mode(cvars: &Cvars) -> Option<Mode> {
    modes::resolve(cvars.integer(Cvar::Mode), custom(cvars), None)
        .or_else(|| modes::resolve(modes::SAFE_MODE, custom(cvars), None))
}

/// Opens the window by the variables and stores it. Does not pass it to the engine's input code.
///
/// # Errors
/// Neither the requested mode nor the safe one works.
pub fn open(engine: Engine, cvars: &Cvars) -> Result<Window, WindowError> {
    if let Some(services) = engine.window() {
        return open_engines(services);
    }
    engine.video_init_hook(false);
    let sdl = Sdl::load()?;
    let driver = sdl.start_video()?;
    engine.cvar_set(c"r_sdlDriver", &driver);

    let mut fullscreen = cvars.flag(Cvar::Fullscreen);
    if fullscreen && engine.cvar_integer(c"in_nograb") != 0 {
        engine.say("Fullscreen is not possible while in_nograb is 1\n");
        engine.cvar_set(c"r_fullscreen", "0");
        fullscreen = false;
    }
    let wish = Wish {
        mode: cvars.integer(Cvar::Mode),
        fullscreen,
        borderless: cvars.flag(Cvar::Noborder),
    };
    let mut last = None;
    for (number, attempt) in attempts(wish).into_iter().enumerate() {
        if number > 0 {
            engine.video_init_hook(true);
        }
        match open_once(engine, cvars, sdl, attempt) {
            Ok(window) => {
                OPEN.0.set(Some(window));
                publish_sizes(engine, &window);
                return Ok(window);
            }
            Err(error) => {
                engine.say(&format!(
                    "r_mode {}{}: {error}\n",
                    attempt.mode,
                    if attempt.fullscreen {
                        ", full screen"
                    } else {
                        ""
                    }
                ));
                last = Some(error);
            }
        }
    }
    sdl.stop_video();
    Err(last
        .unwrap_or(SdlError::Call {
            call: "SDL_CreateWindow",
            message: "no mode to try".into(),
        })
        .into())
}

/// Has the engine open its window.
fn open_engines(services: WindowServices) -> Result<Window, WindowError> {
    // SAFETY: the engine's function, which fills the structure and keeps its address: a static of the front end.
    unsafe { (services.open)(services.config) };
    // SAFETY: the same static, which only this thread uses; copied at once.
    let config = unsafe { services.config.read() };
    let (Ok(width @ 1..), Ok(height @ 1..)) = (
        u32::try_from(config.vidWidth),
        u32::try_from(config.vidHeight),
    ) else {
        return Err(WindowError::Engine);
    };
    let aspect = config.windowAspect;
    let window = Window {
        owner: Owner::Engine {
            services,
            fullscreen: config.isFullscreen != 0,
            refresh_rate: config.displayFrequency,
        },
        size: (width, height),
        aspect: if aspect > 0.0 {
            aspect
        } else {
            width as f32 / height as f32
        },
        stale: false,
    };
    OPEN.0.set(Some(window));
    Ok(window)
}

fn open_once(engine: Engine, cvars: &Cvars, sdl: Sdl, wish: Wish) -> Result<Window, SdlError> {
    let desktop = sdl
        .desktop(0)
        .and_then(|m| Some((u32::try_from(m.w).ok()?, u32::try_from(m.h).ok()?)));
    let Some(mode) = modes::resolve(wish.mode, custom(cvars), desktop) else {
        return Err(SdlError::Call {
            call: "r_mode",
            message: format!("{} is no video mode", wish.mode),
        });
    };
    let mut flags = sdl::flags::SHOWN;
    if wish.fullscreen {
        flags |= sdl::flags::FULLSCREEN;
    } else {
        if wish.borderless {
            flags |= sdl::flags::BORDERLESS;
        }
        if cvars.flag(Cvar::AllowResize) {
            flags |= sdl::flags::RESIZABLE;
        }
    }
    let position = if cvars.flag(Cvar::CenterWindow) {
        sdl::POSITION_CENTERED
    } else {
        sdl::POSITION_ANY
    };
    let raw = sdl.create(c"Relight", position, mode.width, mode.height, flags)?;
    if wish.fullscreen {
        // SAFETY: `raw` was just made by this SDL.
        if let Err(error) = unsafe {
            sdl.set_mode(
                raw,
                mode.width,
                mode.height,
                cvars.integer(Cvar::DisplayRefresh),
            )
        } {
            engine.say(&format!("{error}; the display mode is unchanged\n"));
        }
    }
    // SAFETY: this SDL made `raw` above, for Vulkan, and it is still open.
    let size = unsafe { sdl.drawable_size(raw) }.unwrap_or((mode.width, mode.height));
    let aspect = if size == (mode.width, mode.height) {
        mode.aspect
    } else {
        size.0 as f32 / size.1 as f32
    };
    Ok(Window {
        owner: Owner::Renderer {
            sdl,
            raw,
            given: false,
        },
        size,
        aspect,
        stale: false,
    })
}

fn publish_sizes(engine: Engine, window: &Window) {
    let Owner::Renderer { sdl, raw, .. } = window.owner else {
        return;
    };
    // SAFETY: the caller, `open`, has just made the window.
    let display = unsafe { sdl.display_of(raw) };
    let desktop = sdl
        .desktop(display)
        .and_then(|m| Some((u32::try_from(m.w).ok()?, u32::try_from(m.h).ok()?)));
    let list = modes::available_list(sdl.display_sizes(display), desktop);
    if !list.is_empty() {
        engine.say(&format!("Available modes: '{list}'\n"));
        engine.cvar_set(c"r_availableModes", &list);
    }
}

/// Closes the window, if one is open; SDL's video too, unless another window follows. The engine's input code releases
/// it first. No Vulkan surface of it may be in use.
pub fn close(engine: Engine, closing: Closing) {
    let Some(window) = OPEN.0.take() else { return };
    match window.owner {
        Owner::Renderer { sdl, raw, given } => {
            if given {
                engine.input_shutdown();
            }
            let end_video = closing != Closing::ForAnother;
            // A renderer was abandoned during a call, by a signal or a fatal error: its driver's threads may still
            // present through SDL's connection, which must remain until the process ends.
            if end_video && window.stale {
                return;
            }
            // SAFETY: the window is open, and no other code uses it any more.
            unsafe { sdl.destroy(raw) };
            if end_video {
                sdl.stop_video();
            }
        }
        Owner::Engine { services, .. } => {
            // The engine closes an open window itself before it opens another.
            if closing != Closing::ForAnother && !window.stale {
                // SAFETY: the engine's function; no surface of the window is in use.
                unsafe { (services.close)((closing == Closing::Leave).into()) }
            }
        }
    }
}

/// Passes a new window of ours to the engine's input code.
pub fn give_to_input_once(engine: Engine) {
    let Some(window) = current() else { return };
    if let Owner::Renderer {
        sdl,
        raw,
        given: false,
    } = window.owner
    {
        update(|window| {
            window.owner = Owner::Renderer {
                sdl,
                raw,
                given: true,
            };
        });
        // SAFETY: the window is open, and `close` takes it away from the engine before it ends.
        unsafe { engine.input_init(raw) }
    }
}

/// The instance extensions for surfaces of any window system that the loader offers.
///
/// # Safety
/// `instance_function` must be `vkGetInstanceProcAddr` of a Vulkan loader.
unsafe fn surface_extensions(
    instance_function: unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void,
) -> Vec<CString> {
    /// `VkExtensionProperties`.
    #[repr(C)]
    #[derive(Clone, Copy)]
    struct Extension {
        name: [u8; 256],
        version: u32,
    }
    type Enumerate = unsafe extern "system" fn(*const c_char, *mut u32, *mut Extension) -> i32;
    let name = c"vkEnumerateInstanceExtensionProperties".as_ptr();
    // SAFETY: the loader's function by this function's contract; this name needs no instance.
    let function = unsafe { instance_function(ptr::null_mut(), name) };
    if function.is_null() {
        return Vec::new();
    }
    // SAFETY: the loader's function of that name has this type.
    let enumerate = unsafe { std::mem::transmute::<*mut c_void, Enumerate>(function) };
    let mut count = 0;
    // SAFETY: a place for the count.
    unsafe { enumerate(ptr::null(), &mut count, ptr::null_mut()) };
    let none = Extension {
        name: [0; 256],
        version: 0,
    };
    let mut found = vec![none; count as usize];
    // SAFETY: room for `count` structures.
    unsafe { enumerate(ptr::null(), &mut count, found.as_mut_ptr()) };
    let names = found.iter().take(count as usize);
    names
        .filter_map(|extension| CStr::from_bytes_until_nul(&extension.name).ok())
        .filter(|name| name.to_bytes().ends_with(b"_surface"))
        .map(CStr::to_owned)
        .collect()
}

impl Window {
    /// Window data for a swapchain.
    ///
    /// # Errors
    /// SDL has no Vulkan support for this window, or there is no loader.
    pub fn source(&self) -> Result<renderer_vk::Window, SdlError> {
        let no_loader = || SdlError::Call {
            call: "vkGetInstanceProcAddr",
            message: "there is no Vulkan loader".into(),
        };
        match self.owner {
            Owner::Renderer { sdl, raw, .. } => {
                // SAFETY: the window is open: whoever has a `Window` got it from `current` or `open` in this call.
                let extensions = unsafe { sdl.instance_extensions(raw) }?;
                let entry = sdl.vulkan_entry()?;
                let create = Box::new(move |instance| {
                    if current().is_none_or(|window| !window.is(raw)) {
                        return Err("the window is closed".to_string());
                    }
                    // SAFETY: the window is open; the renderer passes the instance that it made with our extensions.
                    unsafe { sdl.create_surface(raw, instance) }.map_err(|e| e.to_string())
                });
                // SAFETY: SDL's loader stays in memory, because SDL is never closed; the surface is made with the
                // instance given; `Shutdown` drops the renderer before it closes the window, and a stale window's
                // renderer is leaked.
                unsafe { renderer_vk::Window::new(entry, extensions, create) }.ok_or_else(no_loader)
            }
            Owner::Engine { services, .. } => {
                let entry = services.instance_function;
                // SAFETY: the engine's window is open, so that its loader is.
                let extensions = unsafe { surface_extensions(entry) };
                let create = Box::new(move |instance: u64| {
                    let mut surface = 0;
                    let instance = ptr::with_exposed_provenance_mut(instance as usize);
                    // SAFETY: the engine's window is open; the renderer passes the instance that it made with all
                    // extensions for surfaces.
                    match unsafe { (services.create_surface)(instance, &mut surface) } {
                        0 => Err("the engine made no Vulkan surface of its window".to_string()),
                        _ => Ok(surface),
                    }
                });
                // SAFETY: the engine keeps its loader while its window is open; the surface is made with the instance
                // given; `Shutdown` drops the renderer before the window is closed.
                unsafe { renderer_vk::Window::new(entry as *const c_void, extensions, create) }
                    .ok_or_else(no_loader)
            }
        }
    }

    /// Whether it is this window of ours.
    fn is(&self, other: WindowPtr) -> bool {
        matches!(self.owner, Owner::Renderer { raw, .. } if raw == other)
    }

    /// Whether it is in full screen.
    pub fn is_fullscreen(&self) -> bool {
        match self.owner {
            // SAFETY: the window is open: a `Window` is only got from `current`, within one call of the engine.
            Owner::Renderer { sdl, raw, .. } => unsafe { sdl.is_fullscreen(raw) },
            Owner::Engine { fullscreen, .. } => fullscreen,
        }
    }

    /// Whether it is invisible: minimised or not shown yet.
    pub fn is_hidden(&self) -> bool {
        match self.owner {
            // SAFETY: SDL reads the flags of a window that is open: whoever has a `Window` got it from `current` in
            // this call.
            Owner::Renderer { sdl, raw, .. } => unsafe { sdl.is_hidden(raw) },
            // SAFETY: no arguments.
            Owner::Engine { services, .. } => services
                .is_minimized
                .is_some_and(|is_minimized| unsafe { is_minimized() } != 0),
        }
    }

    /// Hz; 0 if unknown.
    pub fn refresh_rate(&self) -> c_int {
        match self.owner {
            // SAFETY: SDL reads the mode of a window that is open: whoever has a `Window` got it from `current` in
            // this call.
            Owner::Renderer { sdl, raw, .. } => unsafe { sdl.refresh_rate(raw) },
            Owner::Engine { refresh_rate, .. } => refresh_rate,
        }
    }

    /// Minimises it, if it is ours.
    pub fn minimize(&self) {
        if let Owner::Renderer { sdl, raw, .. } = self.owner {
            // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing
            // closed it since.
            unsafe { sdl.minimize(raw) }
        }
    }

    /// Present drawable size, pixels; `None` for a window of the engine, which does not report it.
    pub fn drawable_size(&self) -> Option<(u32, u32)> {
        match self.owner {
            // SAFETY: SDL reads the size of a window that is open: whoever has a `Window` got it from `current` or
            // `open` in this call.
            Owner::Renderer { sdl, raw, .. } => unsafe { sdl.drawable_size(raw) },
            Owner::Engine { .. } => None,
        }
    }

    /// Switches full screen on or off; an engine does it for its window by a restart.
    ///
    /// # Errors
    /// An error of SDL.
    fn switch_fullscreen(&self, on: bool) -> Result<(), SdlError> {
        match self.owner {
            // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing
            // closed it since.
            Owner::Renderer { sdl, raw, .. } => unsafe { sdl.switch_fullscreen(raw, on) },
            Owner::Engine { .. } => Ok(()),
        }
    }
}

/// Applies `r_fullscreen`, which the engine changes on Alt+Enter. If the window cannot be switched, or its new size
/// differs from the game's, a command restarts the video system.
pub fn follow_fullscreen(engine: Engine, cvars: &Cvars) {
    if engine.window().is_some() || !cvars.modified(Cvar::Fullscreen) {
        return;
    }
    if let Some(window) = current() {
        let mut wanted = cvars.flag(Cvar::Fullscreen);
        if wanted && engine.cvar_integer(c"in_nograb") != 0 {
            engine.say("Fullscreen is not possible while in_nograb is 1\n");
            engine.cvar_set(c"r_fullscreen", "0");
            wanted = false;
        }
        if wanted != window.is_fullscreen() {
            let switched = window.switch_fullscreen(wanted).is_ok();
            let same_size = window
                .drawable_size()
                .is_none_or(|size| size == window.size);
            if !switched || !same_size {
                engine.append_command(c"vid_restart\n");
            }
            engine.input_restart();
        }
    }
    cvars.seen(Cvar::Fullscreen);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_safe_mode_is_tried_last_and_nothing_twice() {
        let wish = Wish {
            mode: 6,
            fullscreen: true,
            borderless: true,
        };
        let tried = attempts(wish);
        assert_eq!(tried.len(), 3);
        assert_eq!(
            tried[1],
            Wish {
                borderless: false,
                ..wish
            }
        );
        assert_eq!(
            tried[2],
            Wish {
                mode: 3,
                fullscreen: false,
                borderless: false
            }
        );
        assert_eq!(attempts(tried[2]), vec![tried[2]]);
    }
}
