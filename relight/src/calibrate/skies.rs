//! Skies without directives, as lights.
//!
//! Where no directive says how much light a sky gives, bounced rays find its picture, whose brightness says nothing
//! about light. Calibration takes such skies into the lists of lights, with a strength that stored light decides:
//! often none at all.

use crate::light::{self, Emission, EmissionSource};
use crate::world::RelitWorld;
use glam::Vec3;

/// Materials of skies that nothing says the light of.
pub(super) fn unknown_skies(world: &RelitWorld) -> Vec<u32> {
    (0u32..)
        .zip(&world.materials)
        .filter(|(_, m)| m.is_sky() && m.emission.is_none())
        .map(|(i, _)| i)
        .collect()
}

/// Makes lights of them, as bright as they look.
pub(super) fn open(world: &mut RelitWorld, skies: &[u32]) {
    if skies.is_empty() {
        return;
    }
    for &sky in skies {
        if let Some(material) = world.materials.get_mut(sky as usize) {
            // Black pictures give light, too; the strength is only where fitting starts.
            let shown = material.shown.max(Vec3::splat(0.01));
            material.emission = Some(Emission::of(material, EmissionSource::Sky, shown));
        }
    }
    light::place_of(world, |material| skies.contains(&material));
    light::build_lists(world);
}

/// Makes none of them a light again.
pub(super) fn close(world: &mut RelitWorld, skies: &[u32]) {
    if skies.is_empty() {
        return;
    }
    for &sky in skies {
        if let Some(material) = world.materials.get_mut(sky as usize) {
            material.emission = None;
        }
    }
    light::take_out(world, |material| skies.contains(&material));
    light::build_lists(world);
}
