//! Skies without directives, as lights.
//!
//! Where no directive gives a sky's light, bounce rays hit its image, whose brightness is unrelated to the
//! compiler's light. Calibration adds such skies to the light lists with an unknown strength, which the fit decides
//! and which is often zero.

use crate::light::{self, Emission, EmissionSource};
use crate::world::RelitWorld;
use glam::Vec3;

/// Materials of skies without directives.
pub(super) fn unknown_skies(world: &RelitWorld) -> Vec<u32> {
    (0u32..)
        .zip(&world.materials)
        .filter(|(_, m)| m.is_sky() && m.emission.is_none())
        .map(|(i, _)| i)
        .collect()
}

/// Makes them lights, as bright as their image.
pub(super) fn open(world: &mut RelitWorld, skies: &[u32]) {
    if skies.is_empty() {
        return;
    }
    for &sky in skies {
        if let Some(material) = world.materials.get_mut(sky as usize) {
            // The strength is only the start of the fit; a black image may belong to a sky that gives light.
            let shown = material.shown.max(Vec3::splat(0.01));
            material.emission = Some(Emission::of(material, EmissionSource::Sky, shown));
        }
    }
    light::add_triangle_lights_of(world, |material| skies.contains(&material));
    light::build_lists(world);
}

/// Removes them from the lights.
pub(super) fn close(world: &mut RelitWorld, skies: &[u32]) {
    if skies.is_empty() {
        return;
    }
    for &sky in skies {
        if let Some(material) = world.materials.get_mut(sky as usize) {
            material.emission = None;
        }
    }
    light::remove_triangle_lights(world, |material| skies.contains(&material));
    light::build_lists(world);
}
