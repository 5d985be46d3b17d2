//! The renderer library that an id Tech 3 engine loads in place of its OpenGL one.
//!
//! This is the only room with raw pointers from outside. It translates between an engine's C interface and the safe
//! renderer in `renderer_vk`, and owns what these engines leave to their renderers: the window, console variables,
//! console commands, screenshots.
//!
//! # The contract with the engine
//! - One exported symbol, [`GetRefAPI`]. Everything runs on the thread that called it; other threads are refused.
//! - The library stays mapped after the engine unloads it (`-z nodelete`), because code that ever ran a thread cannot be
//!   unmapped safely. So statics outlive an unload, and each `GetRefAPI` rebuilds all state. No thread outlives a call.
//! - Before any service but `Printf` is called the engine is recognized (`ioq3::recognize`): others speak the same
//!   version number with other tables.
//! - No panic and no Rust value that needs dropping is on the stack when the engine's `Error` is called, which leaves by
//!   `longjmp` ([`boundary`]). Services that the engine itself may leave by `longjmp` can cost memory, never
//!   consistency ([`session`]).
//! - Without a usable Vulkan device, found out in `GetRefAPI`, the engine's own OpenGL renderer is loaded from beside
//!   this library and works in our place (`ioq3::fallback`). If the device fails only later, with the real window, the
//!   game ends with a message that says how to start without us: at that point the engine offers no way back.
//!
//! # Modules
//! [`engine`] is at the bottom: the services that the engine offers, as a trait. All other modules but [`ioq3`] use the
//! engine through it and know no structure of the engine's ABI. [`ioq3`] is at the top: it implements the services over
//! ioquake3's table and holds the exports.

mod boundary;
#[cfg(test)]
mod boundary_tests;
#[cfg(test)]
mod c_tests;
mod capture;
mod cinematics;
mod commands;
mod config;
mod costs;
mod cvars;
mod delivery;
mod engine;
mod failure;
mod files;
mod ioq3;
mod logging;
mod session;
mod speeds;
mod window;

use ioq3::abi::{refexport_t, refimport_t};
use std::ffi::c_int;

/// The engine's way in: takes the engine's functions, answers ours; null when the engine speaks another version
/// or has other tables.
///
/// # Safety
/// - `imports` must be null (then the answer is null) or point at the import table of an ioquake3 engine. The table is
///   copied: it need not outlive the call. Its functions must stay callable for as long as the process lives.
/// - The call must come from the engine's main thread while none of our functions runs.
///
/// The answer is static and valid until the next `GetRefAPI`. The functions in it keep to the *call contract* in the
/// head of `boundary`.
#[allow(non_snake_case)] // the engine looks for this name
#[unsafe(no_mangle)]
pub unsafe extern "C" fn GetRefAPI(
    api_version: c_int,
    imports: *const refimport_t,
) -> *const refexport_t {
    // SAFETY: `imports` is null or an ioquake3 engine's table, and the thread is the main one, by this function's
    // contract.
    unsafe { ioq3::get_ref_api(api_version, imports) }
}
