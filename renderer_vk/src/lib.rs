//! The renderer: a safe Rust API over Vulkan. It knows no engine and no C; `ffi` translates for engines and `cli`
//! uses it directly.

#![deny(unsafe_code)]

pub mod api;
pub mod assets;
mod error;
pub mod gpu;
pub mod scene;
pub mod settings;
pub mod trace;
pub mod world;

pub use error::Error;
