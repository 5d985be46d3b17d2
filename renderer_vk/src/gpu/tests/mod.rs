//! The GPU layer on any Vulkan device, with the validation layer if it is installed.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

mod direction;
mod draw_state;
mod drawing;
mod exposure;
mod life;
mod memory;
mod random;
mod rays;
mod support;
