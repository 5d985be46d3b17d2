//! The renderer library that an id Tech 3 engine loads in place of its OpenGL one.
//!
//! All raw pointers from outside stay in this crate. It adapts an engine's C interface to the safe renderer in
//! `renderer_vk`, and implements the parts that these engines leave to their renderers: the window, console variables,
//! console commands, screenshots.
//!
//! # The contract with the engine
//! - One exported function, [`GetRefAPI`]. Everything runs on the thread that called it; calls on other threads are
//!   refused.
//! - The library stays mapped after the engine unloads it (`-z nodelete`, on Windows `system::pin`), because code that has run a thread cannot be
//!   unmapped safely. Statics therefore outlive an unload, and each `GetRefAPI` resets all state. No thread outlives a
//!   call.
//! - The engine is recognized before any service but `Printf` is called (`recognize`): engines have the same version
//!   number with different tables.
//! - When the engine's `Error` is called, which leaves by `longjmp`, no panic is in progress and no destructor is
//!   pending on the stack ([`boundary`]). A service from which the engine leaves by `longjmp` can leak memory, but the
//!   state stays consistent ([`session`]).
//! - If there is no usable Vulkan device, which `GetRefAPI` tests, the engine's own OpenGL renderer is loaded from the
//!   folder of this library and replaces this one (`fallback`). If the device fails later, with the real window,
//!   the game ends with a message that explains how to start with another renderer: the engine supports no other way
//!   then.
//!
//! # Modules
//! [`abi`] holds the structures that all engines share, `engine` the services of any engine as methods over one internal
//! table. A front end ([`ioq3`], [`openarena`], [`quake3e`], [`tremulous`]) is one folder: the engine's tables, a function that fills the
//! internal table, the table of exports, and a row of what is particular to the engine. The other modules name no engine;
//! `front_ends` lists the front ends. `docs/src/port.md` explains how to add one.

pub mod abi;
mod benchmark;
mod boundary;
#[cfg(test)]
mod boundary_tests;
#[cfg(test)]
mod c_tests;
mod capture;
mod cinematics;
mod commands;
mod config;
mod convert;
mod costs;
mod cvars;
mod delivery;
mod engine;
mod exports;
mod failure;
mod fallback;
mod files;
mod front_ends;
mod glconfig;
pub mod ioq3;
mod lifecycle;
mod load;
mod logging;
pub mod openarena;
mod panel;
mod presets;
pub mod quake3e;
mod queries;
mod recognize;
mod reports;
mod scene;
mod session;
mod show_panel;
mod speeds;
mod system;
pub mod tremulous;
mod window;

use std::ffi::{c_int, c_void};

/// Entry point: takes the engine's functions, returns ours; null if the engine has another version of the interface or
/// unknown tables.
///
/// # Safety
/// - `imports` must be null (the result is then null) or point at the import table of an engine of the family. The table
///   is copied: it need not outlive the call. Its functions must be callable until the process ends.
/// - The call must come from the engine's main thread while none of our functions runs.
///
/// The result is static and valid until the next `GetRefAPI`. Its functions have the *call contract* in the module
/// documentation of `boundary`.
#[allow(non_snake_case)] // the engine requires this name
#[unsafe(no_mangle)]
pub unsafe extern "C" fn GetRefAPI(api_version: c_int, imports: *const c_void) -> *const c_void {
    // SAFETY: `imports` is null or an engine's table, and the thread is the main one, by this function's contract.
    unsafe { load::get_ref_api(api_version, imports) }
}

/// A symbol of this library alone: no copy of it, under any file name, is a substitute for it (`fallback`).
#[allow(non_upper_case_globals)]
#[unsafe(no_mangle)]
pub static RelightRenderer: u8 = 1;

/// The name of [`RelightRenderer`].
const MARK: &[u8] = b"RelightRenderer\0";
