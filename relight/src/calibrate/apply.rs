//! What was found, written into the world.

use super::{Solution, columns};
use crate::light::{self, PointLight};
use crate::world::RelitWorld;

/// Radius of the balls that lights put in are drawn from, id units: they keep clear of surfaces by as much.
const PLACED_RADIUS: f32 = super::place::CLEARANCE;

/// Sets strengths, adds lights, and builds the light lists anew.
pub(super) fn apply(world: &mut RelitWorld, solution: &Solution) {
    columns::set_known(world, &solution.known);
    world.ambient = solution.ambient;
    let placed = solution
        .placed
        .iter()
        .map(|&(origin, intensity)| PointLight {
            origin,
            intensity,
            radius: PLACED_RADIUS,
            spot: None,
        });
    world.point_lights.extend(placed);
    if solution.placed.is_empty() {
        return;
    }
    light::build_lists(world);
    world.report.point_lights = world.point_lights.len();
}
