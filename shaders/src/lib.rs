//! The renderer's GLSL, compiled to SPIR-V at build time, and the structures that it shares with Rust.

pub mod types;
