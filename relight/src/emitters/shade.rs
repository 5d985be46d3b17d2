//! What surfaces show of light.

use glam::Vec3;

/// One of the brightnesses of a material's texture: what it shows of the light that falls on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Part of the light that is thrown back, linear: the albedo.
    pub linear: Vec3,
    /// What the engine multiplies stored light by, as encoded for the display.
    pub encoded: Vec3,
    /// How much of its surroundings it mirrors besides, linear.
    pub mirrored: Vec3,
}
