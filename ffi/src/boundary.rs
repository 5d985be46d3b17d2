//! The boundary between the engine's C code and Rust: no panic crosses it, and the engine's error function, which does
//! not return, is called only from frames without live destructors.
//!
//! The engine's `Error` does a `longjmp` to its main loop, and before that calls `Shutdown`, `BeginRegistration` and
//! other exports. A failing call therefore ends completely first: the closure's frame is gone and its destructors have
//! run, the state is back in its cell, the message is in a static buffer.
//!
//! # Call contract
//! Each function that the engine calls (an *export*: the table of exports, console commands, callbacks) is an `unsafe
//! extern "C" fn`. Its `# Safety` section has the requirements on its arguments. These hold for all exports:
//! - **Thread.** The engine calls on the thread that called `GetRefAPI`. On any other thread [`entry`] does nothing and
//!   returns 0; no argument is read. The first such call writes a line to the standard error output.
//! - **Memory.** An export uses a pointer only during the call, unless its section states otherwise; no other code
//!   writes to that memory meanwhile. The memory of game modules is not aligned, so that exports use unaligned
//!   accesses.
//! - **Null.** A pointer may be null unless its section states otherwise. A null input has a value that the section
//!   states; a null output is not written.
//! - **No return.** The call may end in the engine's `Error`, a `longjmp`. Every frame between the engine's `setjmp`
//!   and the export must then be a *plain old frame* (RFC 2945): one without a pending destructor or `catch_unwind`. C
//!   frames are. Rust code that calls an export must be.
//! - **Time.** Before `BeginRegistration` and after `Shutdown` nothing is registered: exports return the values for
//!   absent objects.
//!
//! # Plain frames
//! Reasons for `extern "C"` instead of `extern "C-unwind"`:
//! - The ABI string decides about unwinding. Nothing unwinds across this boundary: [`guarded`] catches every panic, and
//!   the engine is C, without exceptions. With `"C"` a panic that escaped all the same would abort the process; with
//!   `"C-unwind"` it would unwind the engine's C frames.
//! - The ABI string does not affect `longjmp`. RFC 2945 treats both strings alike: to cross a frame with a pending
//!   destructor or `catch_unwind` is undefined; to cross a plain old frame is not specified yet. The Rust Reference
//!   (*Behavior considered undefined*, Rust runtime) forbids deallocating a frame before the destructors of its
//!   variables have run, so that a frame without destructors may be deallocated.
//!
//! So [`entry`] calls `Error` only from plain frames: its own, where `R: Copy` and the closure was moved away, and that
//! of the export, which owns only the closure that it passes to [`entry`].
//!
//! # Services that do not return
//! The engine also leaves by `longjmp` from inside a service that an export calls: for a damaged pack in `FS_ReadFile`,
//! or a full hunk. That crosses [`guarded`] and frames with destructors, which RFC 2945 leaves undefined, and no
//! renderer can prevent it. It works because `longjmp` of the C libraries on Linux restores registers without
//! inspecting the frames between: memory that the frames owned leaks, and [`session`] restarts if one of them had taken
//! the state. A system whose `longjmp` unwinds (Windows) needs another solution.

use crate::engine::error_level;
use crate::failure::Failure;
use crate::{engine, logging, session};
use std::any::Any;
use std::cell::UnsafeCell;
use std::ffi::{c_char, c_int};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

/// Maximum length of a message that the engine copies, bytes.
const MESSAGE_BYTES: usize = 4096;

struct Message(UnsafeCell<[u8; MESSAGE_BYTES]>);

// SAFETY: `keep_message` alone uses it, on the engine's main thread (`entry` refuses other threads first).
unsafe impl Sync for Message {}

static MESSAGE: Message = Message(UnsafeCell::new([0; MESSAGE_BYTES]));

/// Copies `text` into the static buffer, truncated between characters, and returns its address.
fn keep_message(text: &str) -> *const c_char {
    let mut end = text.len().min(MESSAGE_BYTES - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    // SAFETY: main thread only, and no reference into the buffer leaves this function.
    let buffer = unsafe { &mut *MESSAGE.0.get() };
    buffer.fill(0);
    for (to, from) in buffer.iter_mut().zip(text.bytes().take(end)) {
        *to = if from == 0 { b'?' } else { from };
    }
    buffer.as_ptr().cast()
}

/// Message of a panic.
fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("unknown reason")
}

/// Runs one call of the engine. `R` has no destructor, so that no destructor is pending when the engine's error is
/// called.
///
/// For exports only, as their last expression, from a frame that owns nothing: it may not return ([plain
/// frames](self#plain-frames)).
///
/// An error or a panic of `f` becomes the engine's error, from which this does not return. A panic discards the
/// renderer: the next `BeginRegistration` makes a new one. Calls from threads other than the one that called
/// `GetRefAPI` are refused.
pub fn entry<R: Copy + Default>(f: impl FnOnce() -> Result<R, Failure>) -> R {
    if !session::on_main_thread() {
        warn_of_thread();
        return R::default();
    }
    match guarded(f) {
        Ok(value) => value,
        Err((level, message)) => {
            if let Some(error) = engine::current().and_then(|engine| engine.error_function()) {
                // SAFETY: the engine's variadic error with a literal format and one NUL-terminated static string. Its
                // longjmp crosses this frame and the export's, which are plain ("Plain frames" above).
                unsafe { error(level, c"%s".as_ptr(), message) };
            }
            // Reached only with an engine that has no error function.
            R::default()
        }
    }
}

/// Reports once a call from a thread other than that of `GetRefAPI`, past the engine, whose services are the main
/// thread's.
#[inline(never)]
fn warn_of_thread() {
    static DONE: AtomicBool = AtomicBool::new(false);
    if !DONE.swap(true, Ordering::Relaxed) {
        // Nothing is lost without a reader.
        let _ = writeln!(
            std::io::stderr(),
            "Relight draws nothing for a thread that did not call GetRefAPI"
        );
    }
}

/// The part of [`entry`] with destructors, in a frame of its own.
#[inline(never)]
fn guarded<R>(f: impl FnOnce() -> Result<R, Failure>) -> Result<R, (c_int, *const c_char)> {
    let outcome = catch_unwind(AssertUnwindSafe(f));
    let failed = match outcome {
        Ok(Ok(value)) => {
            logging::flush();
            return Ok(value);
        }
        Ok(Err(failure)) => {
            if failure.discard {
                let _ = catch_unwind(session::discard_renderer);
            }
            (failure.level, keep_message(&failure.message))
        }
        Err(payload) => {
            let text = format!(
                "the renderer met a fault of its own{}: {}",
                logging::take_panic_place(),
                panic_text(payload.as_ref())
            );
            let kept = keep_message(&text);
            // After a panic the state may be inconsistent, and dropping it may panic, too. The payload of a second
            // panic is dropped like the first one's.
            let _ = catch_unwind(session::discard_renderer);
            (error_level::DROP, kept)
        }
    };
    logging::flush();
    Err(failed)
}
