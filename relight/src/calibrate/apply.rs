//! Writes a solution into the world.

use super::columns::Lamp;
use super::{Solution, columns, splash};
use crate::light::{self, DEFAULT_SUN_RADIUS, PointLight, SunLight};
use crate::world::RelitWorld;
use glam::Vec3;

/// Radius of placed lights, id units: the clearance that placement keeps from surfaces.
const PLACED_RADIUS: f32 = super::placement::CLEARANCE;

/// Sets the strengths, appends placed lights and suns, and rebuilds the light lists. Back splashes come first among
/// the appended point lights; returns their number.
pub(super) fn apply(world: &mut RelitWorld, solution: &Solution) -> usize {
    let splashes: Vec<_> = splash::of(world)
        .into_iter()
        .zip(&solution.splashes)
        .filter(|(_, strength)| strength.max_element() > 0.0)
        .flat_map(|(of, strength)| {
            let points = of.points.into_iter();
            points.map(|(lamp, power)| (lamp, *strength * power))
        })
        .collect();
    columns::set_known(world, &solution.known);
    world.ambient = solution.ambient;
    let added = splashes.iter().chain(&solution.placed);
    let added = added.map(|&(lamp, intensity)| placed_light(lamp, intensity));
    world.point_lights.extend(added);
    let suns = solution
        .suns
        .iter()
        .map(|&(direction, irradiance)| SunLight {
            direction,
            irradiance,
            angular_radius: DEFAULT_SUN_RADIUS,
            material: None,
        });
    world.suns.extend(suns);
    world.report.suns = world.suns.len();
    let dark = world.lights.iter().any(|l| l.radiance.max_element() <= 0.0);
    if dark {
        // Dark triangle lights are removed from the lists.
        light::remove_triangle_lights(world, |_| false);
    }
    if splashes.is_empty() && solution.placed.is_empty() && !dark {
        return 0;
    }
    light::build_lists(world);
    world.report.point_lights = world.point_lights.len();
    splashes.len()
}

/// The point light for a placed [`Lamp`].
pub(super) fn placed_light(lamp: Lamp, intensity: Vec3) -> PointLight {
    PointLight {
        origin: lamp.origin,
        intensity,
        radius: PLACED_RADIUS,
        spot: None,
        falloff: lamp.falloff,
        pulse: None,
    }
}
