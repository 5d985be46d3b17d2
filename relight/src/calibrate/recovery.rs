//! Measures how well calibration finds known lights: those of maps that kept their light entities.

use crate::light::{self, PointLight};
use crate::world::RelitWorld;
use glam::Vec3;

/// Largest distance of a found light from the true one, id units.
pub const FOUND_WITHIN: f32 = 32.0;

/// Largest relative error of the intensity of a light that counts as found well.
pub const POWER_WITHIN: f32 = 0.15;

/// Largest distance at which a placed light is assigned to a hidden one, id units.
const SAME_WITHIN: f32 = 96.0;

/// Hidden lights, and how many calibration found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Recovery {
    /// Hidden lights.
    pub hidden: usize,
    /// Hidden lights found within [`FOUND_WITHIN`]: placed lights near one count as one at their centroid.
    pub found: usize,
    /// Found lights with an intensity within [`POWER_WITHIN`].
    pub found_well: usize,
    /// Median distance of the found lights from the true ones, id units.
    pub median_distance: f32,
    /// Part of the hidden intensity that was found.
    pub power_found: f32,
    /// Intensity of all placed lights over that of all hidden ones.
    pub power_ratio: f32,
    /// Placed lights that are assigned to no hidden light.
    pub invented: usize,
    /// Their part of the placed intensity.
    pub power_invented: f32,
}

/// Removes the light of entities, as most compilers do, and returns the point lights.
pub fn hide_entities(world: &mut RelitWorld) -> Vec<PointLight> {
    let hidden = std::mem::take(&mut world.point_lights);
    world.suns.retain(|sun| sun.material.is_some());
    world.ambient = Vec3::ZERO;
    light::build_lists(world);
    world.report.point_lights = 0;
    world.report.suns = world.suns.len();
    hidden
}

/// Compares the point lights that calibration placed in `world` with the hidden ones.
pub fn recovery(hidden: &[PointLight], world: &RelitWorld) -> Recovery {
    let level = |light: &PointLight| light.intensity.element_sum() / 3.0;
    let mut gathered = vec![(Vec3::ZERO, 0.0f32); hidden.len()];
    let (mut invented, mut power_invented, mut power_placed) = (0, 0.0, 0.0);
    // Back splashes stand for no entity.
    let splashes = world.calibration.as_ref().map_or(0, |c| c.splashes);
    for placed in world.point_lights.iter().skip(splashes) {
        let power = level(placed);
        power_placed += power;
        let nearest = hidden
            .iter()
            .map(|h| h.origin.distance(placed.origin))
            .zip(&mut gathered)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest {
            Some((distance, sum)) if distance <= SAME_WITHIN => {
                sum.0 += placed.origin * power;
                sum.1 += power;
            }
            _ => {
                invented += 1;
                power_invented += power;
            }
        }
    }
    let mut distances = Vec::new();
    let (mut found_well, mut power_found, mut power_hidden) = (0, 0.0, 0.0);
    for (light, (origin, power)) in hidden.iter().zip(gathered) {
        power_hidden += level(light);
        let distance = (origin / power.max(f32::MIN_POSITIVE)).distance(light.origin);
        if power > 0.0 && distance <= FOUND_WITHIN {
            distances.push(distance);
            power_found += level(light);
            found_well += usize::from((power / level(light) - 1.0).abs() <= POWER_WITHIN);
        }
    }
    distances.sort_by(f32::total_cmp);
    let part = |of: f32, whole: f32| if whole > 0.0 { of / whole } else { 0.0 };
    Recovery {
        hidden: hidden.len(),
        found: distances.len(),
        found_well,
        median_distance: distances.get(distances.len() / 2).copied().unwrap_or(0.0),
        power_found: part(power_found, power_hidden),
        power_ratio: part(power_placed, power_hidden),
        invented,
        power_invented: part(power_invented, power_placed),
    }
}
