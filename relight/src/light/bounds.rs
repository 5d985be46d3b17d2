//! Lights stronger than 32-bit arithmetic can carry, which files may well ask for, are brought into range.

use crate::world::RelitWorld;
use glam::Vec3;

/// Strongest radiance, intensity or irradiance of a light. Its square, and its product with the area of the largest
/// surface that fits into a map, are still finite; lights of real maps stay below a millionth of it.
pub const STRONGEST: f32 = 1.0e12;

/// Brings a strength into range; what is left of an overflow, no number, becomes none. Whether it had to.
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

/// Brings all lights of a world into range; what had to be changed is a warning of the world's.
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
            "{}: {changed} lights are too strong to be computed with; they have strength {STRONGEST:e}",
            world.name
        ));
    }
}
