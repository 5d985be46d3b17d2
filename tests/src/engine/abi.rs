//! The C interface between the stand-in engine and the renderer: the library's own description, whose offsets are
//! compared with those of the engines' headers when it is compiled.

#![allow(missing_docs)] // the engine's constants, under its names

use std::ffi::{c_int, c_void};

pub use relight_ffi::abi::*;
pub use relight_ffi::ioq3::abi::{cvar_t, refexport_t, refimport_t};
pub use relight_ffi::{
    openarena::abi as openarena, quake3e::abi as quake3e, tremulous::abi as tremulous,
};

/// The version that `GetRefAPI` is called with.
pub const REF_API_VERSION: c_int = 8;

pub const ERR_FATAL: c_int = 0;
pub const ERR_DROP: c_int = 1;

pub const CVAR_ARCHIVE: c_int = 0x1;
pub const CVAR_INIT: c_int = 0x10;
pub const CVAR_LATCH: c_int = 0x20;
pub const CVAR_ROM: c_int = 0x40;
pub const CVAR_USER_CREATED: c_int = 0x80;
pub const CVAR_CHEAT: c_int = 0x200;

/// `GetRefAPI` itself.
pub type GetRefAPI = unsafe extern "C" fn(c_int, *const c_void) -> *const c_void;
