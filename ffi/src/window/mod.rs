//! The window: made by the renderer in this family of engines, used by the engine's input code.
//!
//! It lives in a cell of its own, apart from the renderer, because it must stay reachable when a call into the
//! renderer was abandoned by an error of the engine (see `session`).

pub mod modes;
pub mod sdl;

use crate::cvars::{Cvar, Cvars};
use crate::engine::Engine;
use modes::{Custom, Mode};
use sdl::{Sdl, SdlError, WindowPtr};
use std::cell::Cell;
use std::ffi::c_int;

/// An open window.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    sdl: Sdl,
    raw: WindowPtr,
    /// Drawable size in pixels when the renderer was last registered.
    pub size: (u32, u32),
    /// Width over height as seen.
    pub aspect: f32,
    /// A renderer that was never torn down may still present to it: the next registration must replace it.
    pub stale: bool,
    /// The engine's input code has it.
    given: bool,
}

struct OpenWindow(Cell<Option<Window>>);

// SAFETY: exports alone come here, through `boundary::entry`, which refuses all threads but the engine's main one.
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

/// Takes note of the open window's present size: a new renderer starts with that.
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

/// Marks the open window as used by a renderer that can no longer be reached.
pub fn mark_stale() {
    update(|window| window.stale = true);
}

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// Not even the safe mode worked.
    #[error(
        "no window could be opened for Vulkan ({0}); is there a display, and does its driver do Vulkan?"
    )]
    Sdl(#[from] SdlError),
}

/// Video settings of one attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wish {
    mode: i32,
    fullscreen: bool,
    borderless: bool,
}

/// What is tried, in order: what was asked for, the same with a frame, then the safe mode in a window.
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

/// Settings that a crash may have been the fault of go back to safe ones when the engine says that the last run
/// crashed and the player agreed.
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

/// The size to render at without a window.
pub fn headless_mode(cvars: &Cvars) -> Option<Mode> {
    modes::resolve(cvars.integer(Cvar::Mode), custom(cvars), None)
        .or_else(|| modes::resolve(modes::SAFE_MODE, custom(cvars), None))
}

/// Opens the window as the cvars say and remembers it. Does not tell the engine's input code yet.
///
/// # Errors
/// When neither the wanted mode nor the safe one works.
pub fn open(engine: Engine, cvars: &Cvars) -> Result<Window, WindowError> {
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
                publish_sizes(engine, sdl, &window);
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
            engine.say(&format!("{error}; the display keeps its mode\n"));
        }
    }
    // SAFETY: this SDL made `raw` a few lines above, for Vulkan, and nobody closed it.
    let size = unsafe { sdl.drawable_size(raw) }.unwrap_or((mode.width, mode.height));
    let aspect = if size == (mode.width, mode.height) {
        mode.aspect
    } else {
        size.0 as f32 / size.1 as f32
    };
    Ok(Window {
        sdl,
        raw,
        size,
        aspect,
        stale: false,
        given: false,
    })
}

fn publish_sizes(engine: Engine, sdl: Sdl, window: &Window) {
    // SAFETY: the caller, `open`, made the window just now.
    let display = unsafe { sdl.display_of(window.raw) };
    let desktop = sdl
        .desktop(display)
        .and_then(|m| Some((u32::try_from(m.w).ok()?, u32::try_from(m.h).ok()?)));
    let list = modes::available_list(sdl.display_sizes(display), desktop);
    if !list.is_empty() {
        engine.say(&format!("Available modes: '{list}'\n"));
        engine.cvar_set(c"r_availableModes", &list);
    }
}

/// Closes the window, if one is open, and with `end_video` SDL's video too. The engine's input code lets go of it
/// first. No Vulkan surface of it may be in use by a renderer that still runs.
pub fn close(engine: Engine, end_video: bool) {
    let Some(window) = OPEN.0.take() else { return };
    if window.given {
        engine.input_shutdown();
    }
    // A renderer was given up in the middle of a call, by a signal or a fatal error: its driver's threads may still be
    // showing a picture through SDL's connection, which has to stay for the moments that the process has left.
    if end_video && window.stale {
        return;
    }
    // SAFETY: the window is open and forgotten by everybody now.
    unsafe { window.sdl.destroy(window.raw) };
    if end_video {
        window.sdl.stop_video();
    }
}

/// Hands a new window to the engine's input code.
pub fn give_to_input_once(engine: Engine) {
    if let Some(window) = current().filter(|window| !window.given) {
        update(|window| window.given = true);
        // SAFETY: the window is open, and `close` takes it away from the engine before it ends.
        unsafe { engine.input_init(window.raw) }
    }
}

impl Window {
    /// What the renderer needs for a swapchain.
    ///
    /// # Errors
    /// When SDL has no Vulkan for this window.
    pub fn source(&self) -> Result<renderer_vk::Window, SdlError> {
        let (sdl, raw) = (self.sdl, self.raw);
        // SAFETY: the window is open: whoever has a `Window` got it from `current` or `open` in this call.
        let extensions = unsafe { sdl.instance_extensions(raw) }?;
        let entry = sdl.vulkan_entry()?;
        let create = Box::new(move |instance| {
            if current().is_none_or(|window| window.raw != raw) {
                return Err("the window is closed".to_string());
            }
            // SAFETY: the window is open; the renderer passes the instance that it made with our extensions.
            unsafe { sdl.create_surface(raw, instance) }.map_err(|e| e.to_string())
        });
        // SAFETY: SDL's loader stays in memory, because SDL is never closed; the surface is made with the instance
        // given; `Shutdown` drops the renderer before it closes the window, and a stale window's renderer is leaked.
        unsafe { renderer_vk::Window::new(entry, extensions, create) }.ok_or(SdlError::Call {
            call: "SDL_Vulkan_GetVkGetInstanceProcAddr",
            message: "there is no Vulkan loader".into(),
        })
    }

    /// Whether it fills the screen.
    pub fn is_fullscreen(&self) -> bool {
        // SAFETY: the window is open: a `Window` is only got from `current`, within one call of the engine.
        unsafe { self.sdl.is_fullscreen(self.raw) }
    }

    /// Whether it is off the screen: minimised or not shown yet.
    pub fn is_hidden(&self) -> bool {
        // SAFETY: SDL reads the flags of a window that is open: whoever has a `Window` got it from `current` in this
        // call.
        unsafe { self.sdl.is_hidden(self.raw) }
    }

    /// Hz; 0 if unknown.
    pub fn refresh_rate(&self) -> c_int {
        // SAFETY: SDL reads the mode of a window that is open: whoever has a `Window` got it from `current` in this
        // call.
        unsafe { self.sdl.refresh_rate(self.raw) }
    }

    /// Takes it off the screen until the player brings it back.
    pub fn minimize(&self) {
        // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing closed it
        // since.
        unsafe { self.sdl.minimize(self.raw) }
    }

    /// Drawable size in pixels as it is now.
    pub fn drawable_size(&self) -> Option<(u32, u32)> {
        // SAFETY: SDL reads the size of a window that is open: whoever has a `Window` got it from `current` or `open`
        // in this call.
        unsafe { self.sdl.drawable_size(self.raw) }
    }

    /// Fills the screen or stops doing so.
    ///
    /// # Errors
    /// What SDL says.
    pub fn switch_fullscreen(&self, on: bool) -> Result<(), SdlError> {
        // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing closed it
        // since.
        unsafe { self.sdl.switch_fullscreen(self.raw, on) }
    }
}

/// Follows `r_fullscreen`, which the engine changes on Alt+Enter. Where the window cannot be switched, or comes out
/// in another size than the game knows, the video system is restarted by a command.
pub fn follow_fullscreen(engine: Engine, cvars: &Cvars) {
    if !cvars.modified(Cvar::Fullscreen) {
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
