//! The GPU layer on whatever Vulkan device there is, with the validation layer where it is installed.
//!
//! Without a device each test says so and passes, unless `RELIGHT_REQUIRE_GPU=1`.

mod direction;
mod draw_state;
mod drawing;
mod life;
mod memory;
mod random;
mod rays;
mod support;
