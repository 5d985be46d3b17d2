//! The window: the renderer makes it in this family of engines, and the engine's input code uses it.
//!
//! It is stored in its own cell, separate from the renderer, because it must be accessible after an error of the engine
//! has abandoned a call of the renderer (see `session`).

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
    /// Drawable size at the last registration, pixels.
    pub size: (u32, u32),
    /// Width over height of the display.
    pub aspect: f32,
    /// A leaked renderer may still present to it: the next registration must replace the window.
    pub stale: bool,
    /// The engine's input code uses it.
    given: bool,
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
        sdl,
        raw,
        size,
        aspect,
        stale: false,
        given: false,
    })
}

fn publish_sizes(engine: Engine, sdl: Sdl, window: &Window) {
    // SAFETY: the caller, `open`, has just made the window.
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

/// Closes the window, if one is open, and with `end_video` also SDL's video. The engine's input code releases it first.
/// No Vulkan surface of it may be in use.
pub fn close(engine: Engine, end_video: bool) {
    let Some(window) = OPEN.0.take() else { return };
    if window.given {
        engine.input_shutdown();
    }
    // A renderer was abandoned during a call, by a signal or a fatal error: its driver's threads may still present
    // through SDL's connection, which must remain until the process ends.
    if end_video && window.stale {
        return;
    }
    // SAFETY: the window is open, and no other code uses it any more.
    unsafe { window.sdl.destroy(window.raw) };
    if end_video {
        window.sdl.stop_video();
    }
}

/// Passes a new window to the engine's input code.
pub fn give_to_input_once(engine: Engine) {
    if let Some(window) = current().filter(|window| !window.given) {
        update(|window| window.given = true);
        // SAFETY: the window is open, and `close` takes it away from the engine before it ends.
        unsafe { engine.input_init(window.raw) }
    }
}

impl Window {
    /// Window data for a swapchain.
    ///
    /// # Errors
    /// SDL has no Vulkan support for this window.
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

    /// Whether it is in full screen.
    pub fn is_fullscreen(&self) -> bool {
        // SAFETY: the window is open: a `Window` is only got from `current`, within one call of the engine.
        unsafe { self.sdl.is_fullscreen(self.raw) }
    }

    /// Whether it is invisible: minimised or not shown yet.
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

    /// Minimises it.
    pub fn minimize(&self) {
        // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing closed it
        // since.
        unsafe { self.sdl.minimize(self.raw) }
    }

    /// Present drawable size, pixels.
    pub fn drawable_size(&self) -> Option<(u32, u32)> {
        // SAFETY: SDL reads the size of a window that is open: whoever has a `Window` got it from `current` or `open`
        // in this call.
        unsafe { self.sdl.drawable_size(self.raw) }
    }

    /// Switches full screen on or off.
    ///
    /// # Errors
    /// An error of SDL.
    pub fn switch_fullscreen(&self, on: bool) -> Result<(), SdlError> {
        // SAFETY: the window is open: whoever has a `Window` got it from `current` in this call, and nothing closed it
        // since.
        unsafe { self.sdl.switch_fullscreen(self.raw, on) }
    }
}

/// Applies `r_fullscreen`, which the engine changes on Alt+Enter. If the window cannot be switched, or its new size
/// differs from the game's, a command restarts the video system.
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
