//! Bounds on light strengths: files may ask for more than 32-bit arithmetic can carry.

use crate::world::RelitWorld;
use glam::Vec3;

/// Largest radiance, radiant intensity or irradiance of a light. Its square, and its product with the area of the
/// largest surface that fits into a map, are still finite; lights of real maps stay below a millionth of it.
pub const STRONGEST: f32 = 1.0e12;

/// Clamps a strength; NaN becomes 0. Returns whether it changed.
fn bound(strength: &mut Vec3) -> bool {
    let good = strength.is_finite() && strength.abs().max_element() <= STRONGEST;
    if !good {
        let channel = |v: f32| match v {
            v if v.is_nan() => 0.0,
            v => v.clamp(-STRONGEST, STRONGEST),
        };
        *strength = strength.to_array().map(channel).into();
    }
    !good
}

/// Clamps all lights of a world; changes become warnings of the world.
pub(super) fn bound_lights(world: &mut RelitWorld) {
    let mut changed = usize::from(bound(&mut world.ambient));
    let strengths = world
        .lights
        .iter_mut()
        .map(|light| &mut light.radiance)
        .chain(world.point_lights.iter_mut().map(|l| &mut l.intensity))
        .chain(world.suns.iter_mut().map(|sun| &mut sun.irradiance))
        .chain(
            world
                .materials
                .iter_mut()
                .filter_map(|m| m.emission.as_mut())
                .map(|emission| &mut emission.strength),
        );
    for strength in strengths {
        changed += usize::from(bound(strength));
    }
    if changed > 0 {
        world.warnings.push(format!(
            "{}: {changed} lights exceed the largest strength and are clamped to {STRONGEST:e}",
            world.name
        ));
    }
}
