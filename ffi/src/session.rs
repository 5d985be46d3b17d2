//! The library's state between the engine's calls, and the rule of access.
//!
//! A call *takes* the state out of its cell and puts it back when it ends, also on a panic. While it is out, a nested
//! call does nothing, except that `Shutdown` and `BeginRegistration` reset the state: nested, they can only come from
//! an error of the engine inside a service that the outer call used, so that the outer call will never return. The
//! taken state is then leaked, and its window is replaced.

use crate::benchmark::Benchmark;
use crate::capture::Captures;
use crate::cinematics::Cinematics;
use crate::costs::Questions;
use crate::cvars::Cvars;
use crate::failure::Failure;
use crate::panel::Panel;
use crate::presets::Trial;
use crate::window;
use crate::window::input::Input;
use renderer_vk::api::RefDef;
use renderer_vk::{Renderer, Settings};
use std::cell::{Cell, UnsafeCell};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::thread::{self, ThreadId};
use std::time::Instant;

/// The renderer and the front end's state. Fields are dropped in order.
#[derive(Default)]
pub struct Session {
    /// `None` before the first registration and after a failure.
    pub renderer: Option<Renderer>,
    /// The front end's state.
    pub front: Front,
}

/// State of the front end.
#[derive(Default)]
pub struct Front {
    /// Between `BeginRegistration` and `Shutdown`. Calls outside are ignored.
    pub registered: bool,
    /// The engine's variables, once registered.
    pub cvars: Option<Cvars>,
    /// Settings of the last frame.
    pub settings: Settings,
    /// Requested screenshots and video frames; those of the frame being drawn wait for its end.
    pub captures: Captures,
    /// Requests of `rt_stats` and `rt_printPerfStats`.
    pub questions: Questions,
    /// `rt_menu` or `rt_photo`, while it is open.
    pub panel: Option<Panel>,
    /// The game's view of the world in the newest frame.
    pub world_view: Option<RefDef>,
    /// Keys for the panel by a command.
    pub panel_keys: Vec<Input>,
    /// `rt_preset auto`, while it measures.
    pub trial: Option<Trial>,
    /// `rt_benchmark`, while it measures.
    pub benchmark: Option<Benchmark>,
    /// The camera path being recorded by `rt_path`: its file and its lines.
    pub path: Option<(String, String)>,
    /// Videos of materials.
    pub cinematics: Cinematics,
    /// Size of the window as the game received it, pixels.
    pub size: (u32, u32),
    /// Time of the frame's first `BeginFrame`; `None` between frames.
    pub frame_start: Option<Instant>,
    /// The renderer has finished a frame.
    pub has_picture: bool,
    /// Region of 2D pictures: left, top, right, bottom, window pixels.
    pub clip_region: Option<[f32; 4]>,
    /// The engine does not want to see the next frame.
    pub skip_present: bool,
    /// The last shutdown kept the window or the device, for a `GetRefAPI` that may come before the next registration.
    pub kept: bool,
    /// The warning about a NaN origin has been printed.
    pub warned_bad_origin: bool,
}

struct State {
    session: UnsafeCell<Option<Box<Session>>>,
    /// A call has taken the state.
    taken: Cell<bool>,
    /// Number of resets, so that an abandoned call cannot put its old state back.
    generation: Cell<u64>,
}

// SAFETY: every entry point tests `on_main_thread` first.
unsafe impl Sync for State {}

static STATE: State = State {
    session: UnsafeCell::new(None),
    taken: Cell::new(false),
    generation: Cell::new(0),
};

/// The thread of the last `GetRefAPI`.
static MAIN: Mutex<Option<ThreadId>> = Mutex::new(None);

/// Whether this is the engine's main thread.
pub fn on_main_thread() -> bool {
    *MAIN.lock().unwrap_or_else(PoisonError::into_inner) == Some(thread::current().id())
}

/// Resets the state: this thread is the engine's main thread, and nothing is registered. Drops the old state.
pub fn reset() {
    *MAIN.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current().id());
    start_over();
}

/// Whether the state is one that a shutdown kept for the next registration: it must not be reset.
pub fn is_kept() -> bool {
    on_main_thread() && !STATE.taken.get() && with(|session| session.front.kept) == Some(true)
}

fn start_over() {
    STATE.generation.set(STATE.generation.get().wrapping_add(1));
    STATE.taken.set(false);
    // SAFETY: main thread; no reference into the cell is kept (`take` and `put` move).
    let old = unsafe { (*STATE.session.get()).replace(Box::default()) };
    drop(old);
}

/// Puts the state back, also when the call panics.
struct Taken {
    session: Option<Box<Session>>,
    generation: u64,
}

impl Drop for Taken {
    fn drop(&mut self) {
        if self.generation != STATE.generation.get() {
            // The state was reset meanwhile. The old renderer may share a window with the new one, so that it is
            // leaked.
            std::mem::forget(self.session.take());
            return;
        }
        STATE.taken.set(false);
        // SAFETY: main thread; no reference into the cell is kept.
        unsafe { *STATE.session.get() = self.session.take() };
    }
}

/// Runs `f` with the state. `None`: an outer call has taken it, or there was no `GetRefAPI` yet.
pub fn with<R>(f: impl FnOnce(&mut Session) -> R) -> Option<R> {
    // SAFETY: main thread; the value moves out of the cell.
    let session = unsafe { (*STATE.session.get()).take() }?;
    STATE.taken.set(true);
    let mut taken = Taken {
        session: Some(session),
        generation: STATE.generation.get(),
    };
    taken.session.as_deref_mut().map(f)
}

/// Runs `f` with the renderer during a registration; otherwise returns the default, as the engine's own renderer does
/// for calls at the wrong time.
pub fn with_renderer<R: Default>(
    f: impl FnOnce(&mut Renderer, &mut Front) -> Result<R, Failure>,
) -> Result<R, Failure> {
    with(|session| match &mut session.renderer {
        Some(renderer) if session.front.registered => f(renderer, &mut session.front),
        _ => Ok(R::default()),
    })
    .unwrap_or_else(|| Ok(R::default()))
}

/// Like [`with_renderer`], for drawing.
pub fn draw(
    f: impl FnOnce(&mut Renderer, &mut Front) -> Result<(), Failure>,
) -> Result<(), Failure> {
    with_renderer(f)
}

/// Resets a state that an outer call has taken and will never put back.
pub fn abandon_if_taken() {
    if STATE.taken.get() {
        window::mark_stale();
        start_over();
    }
}

/// Drops the renderer after a failure; the next `BeginRegistration` makes a new one.
pub fn discard_renderer() {
    let renderer = with(|session| {
        session.front.registered = false;
        session.front.captures.clear();
        session.front.cinematics.clear();
        session.renderer.take()
    });
    drop(renderer);
}
