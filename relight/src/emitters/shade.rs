//! Reflectance of surfaces.

use glam::Vec3;

/// One class of brightness of a material's texture, and its response to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Albedo, linear.
    pub linear: Vec3,
    /// Factor that the engine applies to display-encoded stored light.
    pub encoded: Vec3,
    /// Additional mirror reflectance, linear.
    pub mirrored: Vec3,
}
