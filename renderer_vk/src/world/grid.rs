//! Light at a point from the light grid.
//!
//! Source: engine behaviour of `renderer_opengl1` (entity lighting); the lookup itself is [`LightGridLayout::sample`].
//!
//! [`LightGridLayout::sample`]: q3bsp::LightGridLayout::sample

use glam::Vec3;
use q3bsp::{Bsp, GridPoint};
use relight::overbright;

use super::WorldData;
use crate::settings::Settings;

/// Light on an entity, in 0..255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridLight {
    /// Ambient light.
    pub ambient: Vec3,
    /// Directed light from `direction`.
    pub directed: Vec3,
    /// Unit vector towards the light; zero if there is none.
    pub direction: Vec3,
}

impl WorldData {
    /// Light at a point after the engine's scales, before its constant ambient part and dynamic lights; `None` without
    /// a light grid.
    pub fn grid_light(&self, point: Vec3, settings: &Settings) -> Option<GridLight> {
        let sample = self.grid?.sample(&self.grid_points, point)?;
        Some(GridLight {
            ambient: sample.ambient * settings.ambient_scale,
            directed: sample.directed * settings.directed_scale,
            direction: sample.direction,
        })
    }
}

/// The points of a map's light grid with the overbright shift applied. The shift keeps the hue and precedes
/// interpolation.
pub(super) fn shifted_points(bsp: &Bsp, shift: u32) -> Vec<GridPoint> {
    bsp.light_grid
        .iter()
        .map(|point| GridPoint {
            ambient: overbright::shift(point.ambient, shift),
            directed: overbright::shift(point.directed, shift),
            ..*point
        })
        .collect()
}
