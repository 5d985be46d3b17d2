//! The front end for ioquake3 (Debian's 1.36 and HEAD: one ABI).
//!
//! A front end for another engine is a module beside this one, with its own tables and window rules; it shares the
//! scene structures in [`abi`] and everything outside of this folder, which calls the engine through [`Services`]. Ten
//! engines pass version 8 to `GetRefAPI`, with seven different tables; [`recognize`] identifies the caller.

pub mod abi;
mod convert;
mod exports;
mod fallback;
mod glconfig;
mod layout;
mod lifecycle;
mod recognize;
mod scene;
pub mod services;

pub use exports::EXPORTS;
#[cfg(test)]
pub use {
    exports::call_everything as call_everything_for_tests,
    lifecycle::shutdown as shutdown_for_tests,
};

use crate::engine::Services;
use crate::{logging, session, window};
use abi::{API_VERSION, refexport_t, refimport_t};
use services::Ioq3;
use std::cell::UnsafeCell;
use std::ffi::c_int;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

/// The table of a substitute renderer, in memory that the engine can read.
struct Borrowed(UnsafeCell<Option<refexport_t>>);

// SAFETY: written and read by `get_ref_api` on the engine's main thread.
unsafe impl Sync for Borrowed {}

static BORROWED: Borrowed = Borrowed(UnsafeCell::new(None));

/// `GetRefAPI`: resets all state for the engine of `imports` and returns our functions, or null if the engine has
/// another version of the interface or other tables. Without usable Vulkan it returns the functions of the engine's own
/// OpenGL renderer.
///
/// # Safety
/// `imports` must be null or point at the import table of an ioquake3 engine, whose functions must be callable until
/// the process ends. The call must come from the engine's main thread while none of our functions runs.
pub unsafe fn get_ref_api(api_version: c_int, imports: *const refimport_t) -> *const refexport_t {
    if imports.is_null() {
        return ptr::null();
    }
    // SAFETY: not null, so it is an engine's table by this function's contract. It lies on the engine's stack, so it is
    // copied.
    let table = unsafe { imports.read_unaligned() };
    // SAFETY: an engine calls this on its main thread, with none of our functions running.
    let engine = unsafe { Ioq3::install(table) };
    if api_version != API_VERSION {
        engine.say(&format!("Relight supports version {API_VERSION} of the renderer interface, this engine has version {api_version}\n"));
        return ptr::null();
    }
    // SAFETY: the table of the engine installed above, which has our version number.
    if let Some(line) = unsafe { recognize::refusal(engine, imports) } {
        engine.say(&format!("{line}\n"));
        return ptr::null();
    }
    logging::install();
    let prepared = catch_unwind(AssertUnwindSafe(|| {
        session::reset();
        // A window that an abandoned renderer left open.
        window::mark_stale();
        lifecycle::probe(engine)
    }));
    let problem = match prepared {
        Ok(Ok(())) => return &EXPORTS,
        Ok(Err(problem)) => problem,
        Err(_) => format!("looking for Vulkan failed{}", logging::take_panic_place()),
    };
    engine.say(&format!("Relight needs Vulkan 1.2: {problem}\n"));
    // SAFETY: `table` is a copy of the engine's import table, which renderers copy in their turn.
    match unsafe { fallback::load(engine, api_version, &table) } {
        Some(exports) => {
            // SAFETY: main thread; the engine copies the table at once.
            unsafe {
                let slot = BORROWED.0.get();
                *slot = Some(exports);
                (*slot).as_ref().map_or(ptr::null(), ptr::from_ref)
            }
        }
        // Without any renderer, our functions: `BeginRegistration` reports the missing item and ends the game.
        None => &EXPORTS,
    }
}
