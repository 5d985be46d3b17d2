//! What crosses rooms: a stand-in engine that loads the built library as a real one does, runs of the real
//! engine, and what both need.
//!
//! * [`engine`]: the stand-in. It uses the library's C interface, so it is the one place here with raw pointers.
//! * [`real`]: Debian's ioquake3, run without a display.
//! * [`data`]: where OpenArena's data, the library and the tools are, and when a test may be skipped.
//! * [`maps`]: small maps made by the tests.
//! * [`camera_path`]: a recorded path through the library, measured.
//! * [`layer`]: sessions on devices with limits and with calls that fail.
//! * [`gallery`]: scenes that the engine's own renderer and ours draw alike, in a private [`display`].

#![deny(unsafe_code)]

pub mod camera_path;
pub mod data;
pub mod display;
#[allow(unsafe_code)]
pub mod engine;
pub mod gallery;
pub mod layer;
pub mod maps;
pub mod real;
pub mod roq;
