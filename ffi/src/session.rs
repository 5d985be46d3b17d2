//! The library's state between the engine's calls, and the rule by which a call gets at it.
//!
//! A call *takes* the state out of its cell and puts it back when it ends, also when it panics. While it is out, a
//! second call finds nothing and does nothing, except that `Shutdown` and `BeginRegistration` start over: they can only
//! come from an error that the engine met inside a service that the first call had asked for, so that the first call
//! will never return. What it had taken is then lost (leaked, in truth) and the window it presented to is replaced.

use crate::capture::Captures;
use crate::cinematics::Cinematics;
use crate::costs::Questions;
use crate::cvars::Cvars;
use crate::failure::Failure;
use crate::window;
use renderer_vk::{Renderer, Settings};
use std::cell::{Cell, UnsafeCell};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::thread::{self, ThreadId};
use std::time::Instant;

/// The renderer and what the front end knows. Fields are destroyed in order.
#[derive(Default)]
pub struct Session {
    /// `None` before the first registration and after a fault.
    pub renderer: Option<Renderer>,
    /// The rest.
    pub front: Front,
}

/// What the front end knows.
#[derive(Default)]
pub struct Front {
    /// Between `BeginRegistration` and `Shutdown`. Calls outside are ignored.
    pub registered: bool,
    /// The engine's variables, once registered.
    pub cvars: Option<Cvars>,
    /// As of the newest frame.
    pub settings: Settings,
    /// Screenshots and video frames to take: those of a frame that is being drawn wait for its end.
    pub captures: Captures,
    /// What `rt_stats` and `rt_printPerfStats` want to know.
    pub questions: Questions,
    /// The camera path that `rt_path` records: its file and the lines so far.
    pub path: Option<(String, String)>,
    /// Videos on materials.
    pub cinematics: Cinematics,
    /// Pixels of the window as the game was told.
    pub size: (u32, u32),
    /// When the frame's first `BeginFrame` came; `None` between frames.
    pub frame_start: Option<Instant>,
    /// The renderer has finished a frame.
    pub has_picture: bool,
    /// An entity without a place was reported already.
    pub warned_bad_origin: bool,
}

struct State {
    session: UnsafeCell<Option<Box<Session>>>,
    /// A call has it.
    taken: Cell<bool>,
    /// Counts fresh starts, so that a call that was given up cannot put its old state back.
    generation: Cell<u64>,
}

// SAFETY: `on_main_thread` is asked by every entry point before it comes here.
unsafe impl Sync for State {}

static STATE: State = State {
    session: UnsafeCell::new(None),
    taken: Cell::new(false),
    generation: Cell::new(0),
};

/// The thread of the newest `GetRefAPI`.
static MAIN: Mutex<Option<ThreadId>> = Mutex::new(None);

/// Whether this is the engine's main thread.
pub fn on_main_thread() -> bool {
    *MAIN.lock().unwrap_or_else(PoisonError::into_inner) == Some(thread::current().id())
}

/// Starts over: this thread is the engine's, nothing is registered. What was there before is destroyed.
pub fn reset() {
    *MAIN.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current().id());
    start_over();
}

fn start_over() {
    STATE.generation.set(STATE.generation.get().wrapping_add(1));
    STATE.taken.set(false);
    // SAFETY: main thread; no reference into the cell is ever kept (`take` and `put` move).
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
            // A fresh start happened meanwhile. The old renderer may share a window with the new one: better leaked.
            std::mem::forget(self.session.take());
            return;
        }
        STATE.taken.set(false);
        // SAFETY: main thread; no reference into the cell is kept.
        unsafe { *STATE.session.get() = self.session.take() };
    }
}

/// Runs `f` with the state. `None`: it is taken by a call further up, or there was no `GetRefAPI` yet.
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

/// Runs `f` with the renderer while it is registered; otherwise answers the default, as the engine's own renderer does
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

/// Like [`with_renderer`], for what draws.
pub fn draw(
    f: impl FnOnce(&mut Renderer, &mut Front) -> Result<(), Failure>,
) -> Result<(), Failure> {
    with_renderer(f)
}

/// Gives up a state that a call further up has taken and will never put back.
pub fn abandon_if_taken() {
    if STATE.taken.get() {
        window::mark_stale();
        start_over();
    }
}

/// Throws the renderer away after a fault; the next `BeginRegistration` makes a new one.
pub fn discard_renderer() {
    let renderer = with(|session| {
        session.front.registered = false;
        session.front.captures.clear();
        session.front.cinematics.clear();
        session.renderer.take()
    });
    drop(renderer);
}
