//! The renderer library that an id Tech 3 engine loads in place of its OpenGL one.
//!
//! All raw pointers from outside stay in this crate. It adapts an engine's C interface to the safe renderer in
//! `renderer_vk`, and implements the parts that these engines leave to their renderers: the window, console variables,
//! console commands, screenshots.
//!
//! # The contract with the engine
//! - One exported symbol, [`GetRefAPI`]. Everything runs on the thread that called it; calls on other threads are
//!   refused.
//! - The library stays mapped after the engine unloads it (`-z nodelete`), because code that has run a thread cannot be
//!   unmapped safely. Statics therefore outlive an unload, and each `GetRefAPI` resets all state. No thread outlives a
//!   call.
//! - The engine is identified before any service but `Printf` is called (`ioq3::recognize`): other engines have the
//!   same version number with other tables.
//! - When the engine's `Error` is called, which leaves by `longjmp`, no panic is in progress and no destructor is
//!   pending on the stack ([`boundary`]). A service from which the engine leaves by `longjmp` can leak memory, but the
//!   state stays consistent ([`session`]).
//! - If there is no usable Vulkan device, which `GetRefAPI` tests, the engine's own OpenGL renderer is loaded from the
//!   folder of this library and replaces this one (`ioq3::fallback`). If the device fails later, with the real window,
//!   the game ends with a message that explains how to start with another renderer: the engine supports no other way
//!   then.
//!
//! # Modules
//! [`engine`] is the lowest module: the engine's services, as a trait. All other modules but [`ioq3`] call the engine
//! through it and use no structure of the engine's ABI. [`ioq3`] is the highest: it implements the services with
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

/// Entry point: takes the engine's functions, returns ours; null if the engine has another version of the interface or
/// other tables.
///
/// # Safety
/// - `imports` must be null (the result is then null) or point at the import table of an ioquake3 engine. The table is
///   copied: it need not outlive the call. Its functions must be callable until the process ends.
/// - The call must come from the engine's main thread while none of our functions runs.
///
/// The result is static and valid until the next `GetRefAPI`. Its functions have the *call contract* in the module
/// documentation of `boundary`.
#[allow(non_snake_case)] // the engine requires this name
#[unsafe(no_mangle)]
pub unsafe extern "C" fn GetRefAPI(
    api_version: c_int,
    imports: *const refimport_t,
) -> *const refexport_t {
    // SAFETY: `imports` is null or an ioquake3 engine's table, and the thread is the main one, by this function's
    // contract.
    unsafe { ioq3::get_ref_api(api_version, imports) }
}
