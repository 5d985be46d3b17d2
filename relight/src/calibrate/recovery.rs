//! How well calibration finds lights again whose truth is known: those of maps that kept their light entities.

use crate::light::{self, PointLight};
use crate::world::RelitWorld;
use glam::Vec3;

/// How far off a light may be to count as found, id units.
pub const FOUND_WITHIN: f32 = 32.0;

/// How far the intensity may be off to count as found well, as a part of it.
pub const POWER_WITHIN: f32 = 0.15;

/// How far off a light is still taken for the one that it stands for, id units.
const SAME_WITHIN: f32 = 96.0;

/// Lights that were hidden, and what was found of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Recovery {
    /// Lights that were hidden.
    pub hidden: usize,
    /// Of these, found within [`FOUND_WITHIN`]: several lights found near one count as one at their centre.
    pub found: usize,
    /// Of these, with an intensity within [`POWER_WITHIN`].
    pub found_well: usize,
    /// Median distance of those found from the truth, id units.
    pub median_distance: f32,
    /// Part of the hidden lights' intensity that lies at those found.
    pub power_found: f32,
    /// Intensity of all lights put in over that of all hidden ones.
    pub power_ratio: f32,
    /// Lights put in that stand for none of the hidden ones.
    pub invented: usize,
    /// Part of the intensity put in that is theirs.
    pub power_invented: f32,
}

/// Takes out the light that entities tell of, as most compilers do: returns its point lights.
pub fn hide_entities(world: &mut RelitWorld) -> Vec<PointLight> {
    let hidden = std::mem::take(&mut world.point_lights);
    world.suns.retain(|sun| sun.material.is_some());
    world.ambient = Vec3::ZERO;
    light::build_lists(world);
    world.report.point_lights = 0;
    world.report.suns = world.suns.len();
    hidden
}

/// Compares the point lights that `world` was given since with those that were hidden.
pub fn recovery(hidden: &[PointLight], world: &RelitWorld) -> Recovery {
    let level = |light: &PointLight| light.intensity.element_sum() / 3.0;
    let mut gathered = vec![(Vec3::ZERO, 0.0f32); hidden.len()];
    let (mut invented, mut power_invented, mut power_placed) = (0, 0.0, 0.0);
    // Those of lamps are no one's entities.
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
